"""The input topics' numbers as the layers below want them, from messages that stay serialised; no ROS is needed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from sysid_node.flight.cdr.message_reader import Text
from sysid_node.flight.frames import tilt_from_quaternion
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU

Numbers = tuple[Any, ...]
Texts = tuple[Text, ...]
Fields = tuple[tuple[str, ...], tuple[str, ...]]

UNREADABLE = "not a message of this type"

_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
_VECTORS = tuple(f"{vector}.{axis}" for vector in ("angular_velocity", "linear_acceleration") for axis in "xyz")
#: What is read of each topic's messages: paths of numbers, in the messages' order, and of strings.
FIELDS: Mapping[str, Fields] = MappingProxyType(
    {
        IMU: ((*_STAMP, *_VECTORS), ("header.frame_id",)),
        AIR_DATA: ((*_STAMP, "true_airspeed", "angle_of_attack", "sideslip", "air_density"), ()),
        ACTUATORS: ((*_STAMP, "position"), ("name",)),
    }
)

#: The same of IMU messages for those who fly by their orientation.
ATTITUDE_FIELDS: Fields = (
    (*_STAMP, *(f"orientation.{axis}" for axis in "xyzw"), "orientation_covariance", *_VECTORS),
    (),
)
_COVARIANCE = 9  # numbers of it


def imu(numbers: Numbers, sign: float) -> tuple[int, tuple[float, ...]]:
    """Stamp (ns), specific force (m/s^2) and rates (rad/s), FRD; ``sign`` -1 turns FLU axes, 1 keeps FRD."""
    seconds, nanoseconds, p, q, r, x, y, z = numbers
    return seconds * 1_000_000_000 + nanoseconds, (x, sign * y, sign * z, p, sign * q, sign * r)


def imu_and_attitude(numbers: Numbers) -> tuple[int, tuple[float, ...], tuple[float, float]]:
    """As ``imu`` of forward-left-up axes, by ``ATTITUDE_FIELDS``; roll and pitch (rad), NaN without orientation."""
    x, y, z, w, covariance = numbers[2:7]
    measured = covariance >= 0.0  # REP-145: -1 where it is not
    tilt = tilt_from_quaternion((x, y, z, w), "flu") if measured else (math.nan, math.nan)
    return *imu((*numbers[:2], *numbers[6 + _COVARIANCE :]), -1.0), tilt


def air_data(numbers: Numbers) -> tuple[int, tuple[float, ...]]:
    """Stamp (ns), true airspeed (m/s), flow angles (rad) and air density (kg/m^3)."""
    seconds, nanoseconds, *values = numbers
    return seconds * 1_000_000_000 + nanoseconds, tuple(values)


def actuators(numbers: Numbers, texts: Texts) -> tuple[int, Text, tuple[float, ...]]:
    """Stamp (ns), names and positions (rad; throttle 0..1 or N) of the joints."""
    seconds, nanoseconds, *positions = numbers
    return seconds * 1_000_000_000 + nanoseconds, texts[0], tuple(positions)
