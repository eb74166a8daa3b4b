"""Where the servos are at present, which the transform of a short stretch needs at its ends.

With a servo of lateness L behind the recorded control x, its position p follows L dp/dt + p = x. The transform of p
over a stretch that ends at t is X + g R (see ``servo_model``), where R is the transform of dx/dt less the impulse
(x - p) at t, and plus that at the stretch's beginning. The signals are these times k, the dynamic pressure over its
reference value, and so are the impulses.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LONGEST = 0.5  # s
REMEMBERED = 1.0  # s: after which it no longer matters where a servo was; several times the latest servos' lateness
SHORTEST = 1e-3  # s: a lateness under which a servo is where it is told to be


@dataclass
class ServoStates:
    """Positions of m servos and what they follow, after the last sample."""

    lateness: list[float]  # (m,) s
    positions: list[float] = field(default_factory=list)
    controls: Sequence[float] = ()
    time: float = -math.inf  # s, of the last sample
    scale: float = 1.0  # k of the last sample
    #: Time, controls, excess and k of the last ``REMEMBERED`` s, oldest first.
    recent: deque[tuple[float, Sequence[float], Sequence[float], float]] = field(default_factory=deque)

    def copy(self) -> ServoStates:
        """The same, which stays as it is."""
        return ServoStates(
            list(self.lateness), list(self.positions), self.controls, self.time, self.scale, deque(self.recent)
        )

    def moved(self, lateness: list[float]) -> ServoStates:
        """Where servos with another ``lateness`` (m,) s would be, having followed the same controls."""
        other = ServoStates(lateness)
        for sample in self.recent:
            other.follow(*sample)
        return other

    def follow(self, time: float, controls: Sequence[float], excess: Sequence[float] = (), scale: float = 1.0) -> None:
        """Follow the controls, which go in straight lines to these values at ``time`` (s), but for an ``excess`` (m,)
        in the mean. At first, and after a gap of more than ``LONGEST`` s, servos are at rest there. ``scale``: k.
        """
        step, self.time, self.scale = time - self.time, time, scale
        recent = self.recent
        recent.append((time, controls, excess, scale))
        while recent[0][0] < time - REMEMBERED:
            recent.popleft()
        if not 0.0 < step <= LONGEST:
            self.positions, self.controls = list(controls), controls
            return
        for i, (late, before, after) in enumerate(zip(self.lateness, self.controls, controls, strict=True)):
            if late < SHORTEST:
                self.positions[i] = after
                continue
            decay = math.exp(-step / late)
            ramp = late / step * (1.0 - decay)
            self.positions[i] = decay * self.positions[i] + (ramp - decay) * before + (1.0 - ramp) * after
            if excess:
                self.positions[i] += (1.0 - decay) * excess[i]
        self.controls = controls

    def impulses(self, unit: Array) -> Array:
        """(R, m) what k (p - x) of the servos is in the transform, by that of a ``unit`` impulse (R,) at this time."""
        if not self.controls:
            return np.zeros((unit.size, len(self.lateness)))
        pairs = zip(self.positions, self.controls, strict=True)
        behind = [self.scale * (position - control) for position, control in pairs]
        return (np.array(behind)[:, None] * unit).T
