"""How much later controls are by the rate limits of their servos, of which the limits' tolerances leave a part unknown.

A servo that ends a move of A at its rate limit R takes A / R for it, and is half of that later, in the mean, than one
that follows at once. What the lines tell of a lateness goes with the square of the control's rate. Over a flight the
limits therefore make a control later by

    late = sum of rate^2 (time since the limit was reached) step / sum of rate^2 step,

which goes with 1 / R: a limit that is off by a share makes the lateness off by as large a share (JCGM 100, eq. 10).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft

Array = NDArray[np.float64]

REACHED = 0.98  # share of its limit from which a servo is taken to be at it
TINY = 1e-12  # (rad/s)^2 s: of a control that has not moved


@dataclass
class RateLimitedMoves:
    """Of m controls: their limits, and the sums over the samples so far."""

    limits: Sequence[float]  # (m,) rad/s; inf = none
    relative: Array  # (m,) 1 sigma of each limit, as a share of it
    limited: list[float]  # (m,) s since each reached its limit
    late: list[float]  # (m,) (rad/s)^2 s^2
    moved: list[float]  # (m,) (rad/s)^2 s

    @classmethod
    def of(cls, aircraft: Aircraft, symbols: Sequence[str]) -> RateLimitedMoves | None:
        """Those of the controls with these ``symbols``; None where no limit is stated, or all are exact."""
        names = {control.symbol: name for name, control in aircraft.controls.items()}
        stated = aircraft.effects.get("actuator_rate_limit", {})
        limits = [stated[name].value if (name := names[symbol]) in stated else math.inf for symbol in symbols]
        tolerances = [aircraft.tolerances.get(f"actuator_rate_limit.{names[symbol]}", 0.0) for symbol in symbols]
        relative = np.array(tolerances) / np.array(limits)
        if not relative.any():
            return None
        none = [0.0] * len(limits)
        return cls(tuple(limits), relative, list(none), list(none), list(none))

    def copy(self) -> RateLimitedMoves:
        """The same, which stays as it is."""
        return replace(self, limited=list(self.limited), late=list(self.late), moved=list(self.moved))

    def follow(self, step: float, before: Sequence[float], after: Sequence[float]) -> None:
        """Take controls (m,), rad, that went in straight lines from ``before`` to ``after`` within a ``step`` (s)."""
        for i, limit in enumerate(self.limits):
            rate = abs(after[i] - before[i]) / step
            self.limited[i] = self.limited[i] + step if rate >= REACHED * limit else 0.0
            energy = rate * rate * step
            self.moved[i] += energy
            self.late[i] += energy * self.limited[i]

    def errors(self) -> Array:
        """(m,) 1 sigma (s) of the lateness by the limits' tolerances."""
        return np.asarray(self.relative * np.array(self.late) / (np.array(self.moved) + TINY))
