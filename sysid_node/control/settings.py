"""Settings of the controller."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from sysid_node.errors import InputError

#: Allowed values, both ends included.
RANGES: Mapping[str, tuple[float, float]] = {
    "actuator_lag": (0.005, 1.0),
    "delay": (0.0, 0.5),
    "gain_margin": (1.0, 6.0),
    "phase_margin": (0.0, 1.2),
    "tightness": (0.0, 10.0),
    "explained": (0.0, 1.0),
    "gain_rate": (0.01, 100.0),
    "stale_after": (0.02, 60.0),
    "command_rate": (0.1, 100.0),
    "command_limit": (0.01, 1.5),
    "bandwidth": (0.2, 20.0),
    "largest_roll": (0.05, 1.2),
    "largest_pitch": (0.05, 0.8),
    "largest_sideslip": (0.0, 0.4),
    "largest_excitation": (0.0, 0.5),
    "largest_tracking_error": (0.1, 3.0),
    "set_points_expire_after": (0.1, 3600.0),
}


@dataclass(frozen=True)
class ControllerSettings:
    """Settings of the controller; defaults suit UAVs of 1 to 20 kg. Raises InputError on impossible values."""

    adapt: bool = True  # false: always the gains for the aircraft file
    actuator_lag: float = 0.05  # s, first-order, of the surfaces
    delay: float = 0.02  # s, from a reading to its command's arrival at the actuator
    gain_margin: float = 2.0  # least gain margin of every loop, a factor (6 dB)
    phase_margin: float = math.pi / 4.0  # rad, least phase margin of every loop
    tightness: float = 0.4  # half an interval over the derivative's size, beyond which the estimate is not used
    explained: float = 0.9  # least R^2 of a coefficient's equation, for its derivatives to be used
    gain_rate: float = 1.0  # 1/s, rate of change of the gains relative to the baseline's
    stale_after: float = 0.3  # s without estimates, after which the baseline gains are flown
    command_rate: float = 4.0  # rad/s, of a surface's command
    command_limit: float = 0.35  # rad, of a surface's command where the aircraft file gives no limit
    bandwidth: float = 2.5  # rad/s, of the reference model of the attitude
    largest_roll: float = 0.8  # rad
    largest_pitch: float = 0.4  # rad
    largest_sideslip: float = 0.15  # rad
    largest_excitation: float = 0.1  # rad, of each surface; never more than the surface's own limit
    largest_tracking_error: float = 0.6  # rad of pitch or roll, beyond which the baseline gains are flown
    set_points_expire_after: float = 2.0  # s, after which level flight is flown

    def __post_init__(self) -> None:
        for name, (lower, upper) in RANGES.items():
            value = getattr(self, name)
            if not lower <= value <= upper:
                raise InputError(f"setting {name} = {value!r}: expected {lower:g} to {upper:g}")

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> ControllerSettings:
        """The settings among the values. Raises InputError on impossible ones."""
        names = {field.name for field in fields(cls)}
        return cls(**{name: value for name, value in values.items() if name in names})
