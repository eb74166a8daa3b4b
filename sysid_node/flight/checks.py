"""Plausibility limits: messages with values that no fixed-wing aircraft measures are rejected, with a reason.

The limits are far outside the motion of aircraft of any size, and narrow enough to detect degrees given for radians.
The functions ``*_fault`` check single messages, and ``*_faults`` apply the same checks to arrays of messages.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array

FORCE_LIMIT = 300.0  # m/s^2
RATE_LIMIT = 35.0  # rad/s: 2000 deg/s, the range of common gyros
AIRSPEED_LOW, AIRSPEED_HIGH = 0.5, 400.0  # m/s
ANGLE_LIMIT = math.pi / 2.0  # rad
DENSITY_LOW, DENSITY_HIGH = 0.01, 2.0  # kg/m^3
THROTTLE_LIMIT = 1.5  # of full throttle
THRUST_LIMIT = 1.0e7  # N

NOT_FINITE = "not finite"
FORCE = f"specific force over {FORCE_LIMIT:g} m/s^2"
RATE = f"angular rate over {RATE_LIMIT:g} rad/s (deg/s?)"
AIRSPEED = f"true_airspeed not within {AIRSPEED_LOW:g} to {AIRSPEED_HIGH:g} m/s"
NO_AIRSPEED = "true_airspeed not measured"
ALPHA = "angle_of_attack over pi/2 rad (degrees?)"
BETA = "sideslip over pi/2 rad (degrees?)"
DENSITY = f"air_density not within {DENSITY_LOW:g} to {DENSITY_HIGH:g} kg/m^3"
THROTTLE = f"throttle over {THROTTLE_LIMIT:g} (percent?)"
THRUST = f"thrust over {THRUST_LIMIT:g} N"

#: ROS counts a stamp's seconds in 32 bits; a day is left for what is stamped some time after a message.
LATEST_STAMP_NS = (2**31 - 86_400) * 1_000_000_000
UNSTAMPED = "no stamp"
BEYOND = "stamp beyond January 2038"
DUPLICATE = "duplicate stamp"
OUT_OF_ORDER = "out of order"
CLOCK_STEP = "clock step"


def gap(topic: str) -> str:
    """The reason where an IMU message has no neighbours in another topic that are near enough."""
    return f"{topic} gap"


def no_joint(name: str) -> str:
    """The reason where a joint that the aircraft file names has no finite position."""
    return f"joint {name!r} missing or not finite"


def joint_angle(name: str) -> str:
    """The reason where a joint is deflected further than any surface can be."""
    return f"joint {name!r} over pi/2 rad (degrees?)"


def is_nan(x: float) -> bool:
    """Whether x is NaN. Unlike ``math.isnan`` it accepts integers of any size."""
    return not -math.inf <= x <= math.inf


def imu_fault(values: Sequence[float]) -> str | None:
    """What is wrong with ax ay az (m/s^2) p q r (rad/s), or None."""
    ax, ay, az, p, q, r = values
    if (
        -FORCE_LIMIT < ax < FORCE_LIMIT
        and -FORCE_LIMIT < ay < FORCE_LIMIT
        and -FORCE_LIMIT < az < FORCE_LIMIT
        and -RATE_LIMIT < p < RATE_LIMIT
        and -RATE_LIMIT < q < RATE_LIMIT
        and -RATE_LIMIT < r < RATE_LIMIT
    ):
        return None
    if not all(-math.inf < x < math.inf for x in values):
        return NOT_FINITE
    return RATE if all(-FORCE_LIMIT < x < FORCE_LIMIT for x in values[:3]) else FORCE


def imu_faults(values: Array) -> NDArray[np.object_]:
    """``imu_fault`` of each row of (N, 6)."""
    size = np.abs(values)
    return _first(
        (~np.isfinite(values).all(axis=1), NOT_FINITE),
        ((size[:, :3] >= FORCE_LIMIT).any(axis=1), FORCE),
        ((size[:, 3:] >= RATE_LIMIT).any(axis=1), RATE),
    )


def air_data_fault(values: Sequence[float]) -> str | None:
    """What is wrong with V (m/s), alpha, beta (rad), rho (kg/m^3), or None; flow angles and density may be NaN."""
    V, alpha, beta, rho = values
    if is_nan(V):
        return NO_AIRSPEED
    if not AIRSPEED_LOW < V < AIRSPEED_HIGH:
        return AIRSPEED
    if abs(alpha) > ANGLE_LIMIT:
        return ALPHA
    if abs(beta) > ANGLE_LIMIT:
        return BETA
    if not is_nan(rho) and not DENSITY_LOW < rho < DENSITY_HIGH:
        return DENSITY
    return None


def air_data_faults(values: Array) -> NDArray[np.object_]:
    """``air_data_fault`` of each row of (N, 4)."""
    V, alpha, beta, rho = values.T
    return _first(
        (np.isnan(V), NO_AIRSPEED),
        (~((V > AIRSPEED_LOW) & (V < AIRSPEED_HIGH)), AIRSPEED),
        (np.abs(alpha) > ANGLE_LIMIT, ALPHA),
        (np.abs(beta) > ANGLE_LIMIT, BETA),
        ((rho <= DENSITY_LOW) | (rho >= DENSITY_HIGH), DENSITY),
    )


def joint_fault(name: str, position: float) -> str | None:
    """What is wrong with a surface joint's position (rad), or None."""
    if not -math.inf < position < math.inf:
        return no_joint(name)
    return joint_angle(name) if abs(position) > ANGLE_LIMIT else None


def throttle_limit(in_newton: bool) -> float:
    """The largest throttle, or thrust in N, that is accepted."""
    return THRUST_LIMIT if in_newton else THROTTLE_LIMIT


def throttle_fault(position: float, in_newton: bool) -> str | None:
    """What is wrong with the throttle joint (0..1, or N), or None; it may be NaN."""
    if abs(position) > throttle_limit(in_newton):
        return THRUST if in_newton else THROTTLE
    return None


def _first(*cases: tuple[Any, str]) -> NDArray[np.object_]:
    """For each row the reason of the first case (N,) that is true, or None."""
    faults = np.full(cases[0][0].shape, None, object)
    for wrong, reason in reversed(cases):
        faults[wrong] = reason
    return faults
