"""The input topics' numbers as the layers below want them, from messages that stay serialised; no ROS is needed."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from sysid_node.flight.cdr_single import Text
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU

Numbers = tuple[Any, ...]
Texts = tuple[Text, ...]

UNREADABLE = "not a message of this type"

_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
_VECTORS = tuple(f"{vector}.{axis}" for vector in ("angular_velocity", "linear_acceleration") for axis in "xyz")
#: What is read of each topic's messages: paths of numbers, in the messages' order, and of strings.
FIELDS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = MappingProxyType(
    {
        IMU: ((*_STAMP, *_VECTORS), ("header.frame_id",)),
        AIR_DATA: ((*_STAMP, "true_airspeed", "angle_of_attack", "sideslip", "air_density"), ()),
        ACTUATORS: ((*_STAMP, "position"), ("name",)),
    }
)


def imu(numbers: Numbers, sign: float) -> tuple[int, tuple[float, ...]]:
    """Stamp (ns), specific force (m/s^2) and rates (rad/s), FRD; ``sign`` -1 turns FLU axes, 1 keeps FRD."""
    seconds, nanoseconds, p, q, r, x, y, z = numbers
    return seconds * 1_000_000_000 + nanoseconds, (x, sign * y, sign * z, p, sign * q, sign * r)


def air_data(numbers: Numbers) -> tuple[int, tuple[float, ...]]:
    """Stamp (ns), true airspeed (m/s), flow angles (rad) and air density (kg/m^3)."""
    seconds, nanoseconds, *values = numbers
    return seconds * 1_000_000_000 + nanoseconds, tuple(values)


def actuators(numbers: Numbers, texts: Texts) -> tuple[int, Text, tuple[float, ...]]:
    """Stamp (ns), names and positions (rad; throttle 0..1 or N) of the joints."""
    seconds, nanoseconds, *positions = numbers
    return seconds * 1_000_000_000 + nanoseconds, texts[0], tuple(positions)
