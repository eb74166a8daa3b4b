"""The numbers of the input topics' messages, from messages that stay serialised."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from sysid_node.flight.cdr.message_reader import Text
from sysid_node.flight.checks import LATEST_STAMP_NS
from sysid_node.flight.frames import BodyFrame, tilt_from_quaternion
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU

Numbers = tuple[Any, ...]
Texts = tuple[Text, ...]
#: Dotted paths of numbers, in the messages' order, and of strings; what a ``MessageReader`` reads.
Paths = tuple[tuple[str, ...], tuple[str, ...]]

UNREADABLE = "not a message of this type"
TOO_LATE = "stamped beyond January 2038"
#: Seconds of a stamp from which on a message is left out.
LATEST_SECONDS = LATEST_STAMP_NS // 1_000_000_000

_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
_VECTORS = tuple(f"{vector}.{axis}" for vector in ("angular_velocity", "linear_acceleration") for axis in "xyz")
#: What is read of the messages of each input topic.
PATHS: Mapping[str, Paths] = MappingProxyType(
    {
        IMU: ((*_STAMP, *_VECTORS), ("header.frame_id",)),
        AIR_DATA: ((*_STAMP, "true_airspeed", "angle_of_attack", "sideslip", "air_density"), ()),
        ACTUATORS: ((*_STAMP, "position"), ("name",)),
    }
)

#: What is read of IMU messages where the orientation is needed, too.
ATTITUDE_PATHS: Paths = (
    (*_STAMP, *(f"orientation.{axis}" for axis in "xyzw"), "orientation_covariance", *_VECTORS),
    ("header.frame_id",),
)
_COVARIANCE = 9  # numbers in a covariance matrix


def imu(numbers: Numbers, frame: BodyFrame) -> tuple[int, tuple[float, ...]]:
    """Stamp (ns), specific force (m/s^2) and rates (rad/s), FRD, of a message in the axes of a ``frame``."""
    seconds, nanoseconds, p, q, r, x, y, z = numbers
    sign = 1.0 if frame == "frd" else -1.0
    return seconds * 1_000_000_000 + nanoseconds, (x, sign * y, sign * z, p, sign * q, sign * r)


def imu_and_attitude(numbers: Numbers, frame: BodyFrame) -> tuple[int, tuple[float, ...], tuple[float, float]]:
    """As ``imu``, and roll and pitch (rad), NaN without orientation; of ``ATTITUDE_PATHS``."""
    x, y, z, w, covariance = numbers[2:7]
    measured = covariance >= 0.0  # REP-145: -1 where there is no orientation
    tilt = tilt_from_quaternion((x, y, z, w), frame) if measured else (math.nan, math.nan)
    return *imu((*numbers[:2], *numbers[6 + _COVARIANCE :]), frame), tilt


def air_data(numbers: Numbers) -> tuple[int, tuple[float, ...]]:
    """Stamp (ns), and true airspeed (m/s), angle of attack and sideslip (rad), air density (kg/m^3)."""
    seconds, nanoseconds, *values = numbers
    return seconds * 1_000_000_000 + nanoseconds, tuple(values)


def actuators(numbers: Numbers, texts: Texts) -> tuple[int, Text, tuple[float, ...]]:
    """Stamp (ns), names and positions of the joints: rad; throttle 0..1 or N."""
    seconds, nanoseconds, *positions = numbers
    return seconds * 1_000_000_000 + nanoseconds, texts[0], tuple(positions)
