"""Attitudes as unit quaternions."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from sysid_node.flight.checks import RATE_LIMIT

#: An attitude is not propagated over more than this time, s.
OLDEST = 0.1


class Attitude(NamedTuple):
    """A unit quaternion that rotates vectors from body axes to world axes."""

    w: float
    x: float
    y: float
    z: float

    def times(self, other: Attitude) -> Attitude:
        """The rotation by ``other`` followed by this one (Hamilton's product)."""
        a, b, c, d = self
        w, x, y, z = other
        return Attitude(
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        )


_HALF = math.sqrt(0.5)
_WORLDS = Attitude(0.0, _HALF, _HALF, 0.0)  # half a turn about x = y, between east-north-up and north-east-down
_BODIES = Attitude(0.0, 1.0, 0.0, 0.0)  # half a turn about x, between forward-left-up and forward-right-down


def other_axes(attitude: Attitude) -> Attitude:
    """The attitude of FLU axes in ENU from that of FRD axes in NED, or the reverse.

    The sign of the quaternion may change.
    """
    return _WORLDS.times(attitude).times(_BODIES)


def attitude_of(quaternion: Any) -> Attitude | None:
    """The attitude in a geometry_msgs/Quaternion; None where its length is not 1, as for zeros that mean "unknown"."""
    return normalised(Attitude(*(float(getattr(quaternion, axis)) for axis in "wxyz")))


def normalised(attitude: Attitude) -> Attitude | None:
    """The quaternion scaled to length 1; None where its length differs from 1 by more than 1 %."""
    length = math.sqrt(sum(part * part for part in attitude))
    return Attitude(*(part / length for part in attitude)) if abs(length - 1.0) < 0.01 else None


def propagated(attitude: Attitude, rates: tuple[float, float, float], seconds: float) -> Attitude:
    """The attitude ``seconds`` later, at constant body rates (rad/s)."""
    speed = math.sqrt(sum(rate * rate for rate in rates))
    half = 0.5 * speed * seconds
    share = math.sin(half) / speed if speed else 0.0
    return attitude.times(Attitude(math.cos(half), *(share * rate for rate in rates)))


class LastAttitude:
    """The newest attitude, propagated to the times at which the rates are measured."""

    def __init__(self) -> None:
        self._stamp_ns = 0
        self._attitude: Attitude | None = None

    def heard(self, stamp_ns: int, attitude: Attitude | None) -> None:
        """Take a newer attitude, None where it is unknown."""
        self._stamp_ns, self._attitude = stamp_ns, attitude

    def at(self, stamp_ns: int, rates: tuple[float, float, float]) -> Attitude | None:
        """The attitude at a time (ns), at these body rates (rad/s).

        None where the newest is over 0.1 s away, or the rates are none of an aircraft (see ``flight.checks``).
        """
        seconds = (stamp_ns - self._stamp_ns) / 1e9
        turning = all(abs(rate) <= RATE_LIMIT for rate in rates)
        if self._attitude is None or not turning or not abs(seconds) <= OLDEST:
            return None
        return propagated(self._attitude, rates, seconds)
