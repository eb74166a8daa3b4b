"""Attitudes as unit quaternions, message by message."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

#: Beyond this age (s) an attitude is not carried to another time.
OLDEST = 0.1


class Attitude(NamedTuple):
    """Turns body axes into the world's."""

    w: float
    x: float
    y: float
    z: float

    def times(self, other: Attitude) -> Attitude:
        """First the other turn, then this one (Hamilton's product)."""
        a, b, c, d = self
        w, x, y, z = other
        return Attitude(
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        )


_HALF = math.sqrt(0.5)
_WORLDS = Attitude(0.0, _HALF, _HALF, 0.0)  # half a turn about x = y: east-north-up, north-east-down
_BODIES = Attitude(0.0, 1.0, 0.0, 0.0)  # half a turn about x: forward-left-up, forward-right-down


def other_axes(attitude: Attitude) -> Attitude:
    """The same attitude between the other axes: FLU in ENU of FRD in NED, and the way back (but for the sign)."""
    return _WORLDS.times(attitude).times(_BODIES)


def attitude_of(quaternion: Any) -> Attitude | None:
    """Of a geometry_msgs/Quaternion; None where it is not of unit length, as zeros are that mean nothing."""
    return normalised(Attitude(*(float(getattr(quaternion, axis)) for axis in "wxyz")))


def normalised(attitude: Attitude) -> Attitude | None:
    """Made one long; None where it is not within 1 % of that."""
    length = math.sqrt(sum(part * part for part in attitude))
    return Attitude(*(part / length for part in attitude)) if abs(length - 1.0) < 0.01 else None


def propagated(attitude: Attitude, rates: tuple[float, float, float], seconds: float) -> Attitude:
    """The attitude ``seconds`` later, turning at constant body rates (rad/s)."""
    speed = math.sqrt(sum(rate * rate for rate in rates))
    half = 0.5 * speed * seconds
    share = math.sin(half) / speed if speed else 0.0
    return attitude.times(Attitude(math.cos(half), *(share * rate for rate in rates)))


class LastAttitude:
    """The newest attitude heard, carried to the times at which the rates are measured."""

    def __init__(self) -> None:
        self._stamp_ns = 0
        self._attitude: Attitude | None = None

    def heard(self, stamp_ns: int, attitude: Attitude | None) -> None:
        """One more."""
        self._stamp_ns, self._attitude = stamp_ns, attitude

    def at(self, stamp_ns: int, rates: tuple[float, float, float]) -> Attitude | None:
        """At a time within 0.1 s of it, turning at these body rates (rad/s); else None."""
        seconds = (stamp_ns - self._stamp_ns) / 1e9
        if self._attitude is None or not abs(seconds) <= OLDEST:
            return None
        return propagated(self._attitude, rates, seconds)
