"""The set-points that are flown: the last ones, until they expire."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from sysid_node.control.types import SetPoints

UNITS: Mapping[str, str] = {"airspeed": "m/s", "pitch_rate": "rad/s"}  # of the set-points that are no angles


@dataclass
class SetPointInput:
    """The last set-points and their age; times are in s of a clock that never jumps."""

    expire_after: float  # s
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # least and largest, by name
    points: SetPoints = field(default_factory=SetPoints)
    received_at: float = -math.inf

    def receive(self, time: float, values: Mapping[str, float]) -> list[str]:
        """Take set-points by name (rad, m/s, rad/s). Returns what is wrong with them, one line each.

        An unknown name and an infinite value are left out. NaN, as no value, means level flight's. What is beyond its
        limits is flown at the limit.
        """
        known = {name: value for name, value in values.items() if name in SetPoints._fields}
        wrong = [_unknown(name) for name in values if name not in known]
        wrong += [f"set-point {name!r} is infinite: left out" for name, value in known.items() if math.isinf(value)]
        finite = {name: value for name, value in known.items() if math.isfinite(value)}
        wrong += [self._beyond(name, value) for name, value in finite.items() if self._limited(name, value) != value]
        self.points, self.received_at = SetPoints(**finite), time
        return wrong

    def _limited(self, name: str, value: float) -> float:
        lower, upper = self.limits.get(name, (value, value))
        return min(max(value, lower), upper)

    def _beyond(self, name: str, value: float) -> str:
        (lower, upper), unit = self.limits[name], UNITS.get(name, "rad")
        allowed = f"{lower:.4g} to {upper:.4g} {unit}"
        return f"set-point {name!r} of {value:.4g} {unit} is beyond {allowed}: the limit is flown"

    def current(self, time: float) -> SetPoints:
        """The set-points at a time (s): level flight's where they have expired or none has come."""
        return SetPoints() if self.expired(time) else self.points

    def expired(self, time: float) -> bool:
        """Whether set-points have come, but too long ago."""
        return math.isfinite(self.received_at) and time - self.received_at > self.expire_after


def _unknown(name: str) -> str:
    near = difflib.get_close_matches(name, SetPoints._fields, n=1)
    meant = f"did you mean {near[0]!r}?" if near else f"expected {', '.join(SetPoints._fields)}"
    return f"set-point {name!r} is not known: left out; {meant}"
