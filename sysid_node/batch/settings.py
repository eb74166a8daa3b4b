"""Settings of the batch estimators, for ``--set``, ``summary.json`` and tests."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, get_type_hints

from sysid_node.errors import InputError
from sysid_node.flight.commanded import CARRIED
from sysid_node.setting import check_frequencies, parse_setting
from sysid_node.suggestion import did_you_mean

#: Hz; well above the short period of a small aircraft, well below its sensors' bandwidth.
DEFAULT_LOW_PASS = 3.0
LOWEST_LOW_PASS = 0.01  # Hz: a filter this slow leaves nothing of a flight's motion
LONGEST_BRIDGED = 3600.0  # s: beyond it, it is another flight

#: Hz: first line, step, last line.
Frequencies = tuple[float, float, float]

#: The short-period band of most aircraft; below it trim and phugoid, above it noise.
DEFAULT_FREQUENCIES: Frequencies = (0.1, 0.04, 2.0)


@dataclass(frozen=True)
class BatchSettings:
    """The settings of the batch estimators; raises InputError on impossible values."""

    frequencies: Frequencies = DEFAULT_FREQUENCIES  # Hz: first line, step, last line (frequency_equation_error)
    low_pass: float = DEFAULT_LOW_PASS  # Hz: what is above is left out; 0 = nothing (equation_error)
    rate: float = 100.0  # Hz: faster measurements are averaged down to it; 0 = none (output_error, filter_error)
    segment: float = 10.0  # s: flights are cut into pieces this long, each with its own initial state; 0 = whole
    states: tuple[str, ...] = ()  # to be integrated; the others count as measured. Empty: what the model allows
    biases: tuple[str, ...] = ()  # outputs whose bias is estimated for each piece
    use_prior: bool = False  # whether the aircraft file's tolerances count
    stepwise: bool = False  # leave out regressors that the data do not support (by equation error)
    correct_sensors: bool = False  # estimate IMU and air-data errors from the kinematics first, and take them out
    process_noise: float = 1.0  # times that of light turbulence (Kalman filters of state and parameters); 0 = none
    max_gap: float = 0.2  # s: the longest gap in a bag that is bridged by interpolation
    actuators: str = "auto"  # what the topic actuators carries: "commands", "positions", or "auto", by the messages

    def __post_init__(self) -> None:
        check_frequencies(self.frequencies)
        for name in ("low_pass", "rate", "segment", "process_noise"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise InputError(f"setting {name} = {value}: expected a number, zero or more")
        if 0.0 < self.low_pass < LOWEST_LOW_PASS:
            raise InputError(f"setting low_pass = {self.low_pass}: expected 0 or at least {LOWEST_LOW_PASS:g} Hz")
        if self.actuators not in CARRIED:
            raise InputError(f"setting actuators = {self.actuators!r}: expected one of {', '.join(CARRIED)}")
        if not 0.0 < self.max_gap <= LONGEST_BRIDGED:
            raise InputError(
                f"setting max_gap = {self.max_gap}: expected seconds, more than zero and at most {LONGEST_BRIDGED:g}"
            )

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> BatchSettings:
        """From ``--set key=value`` texts or plain values. Raises InputError naming the wrong key or value."""
        kinds = get_type_hints(cls)
        for key in values:
            if key not in kinds:
                meant = did_you_mean(key, kinds)
                raise InputError(f"setting {key!r} is not one of a batch method; those are {', '.join(kinds)}{meant}")
        return cls(**{key: parse_setting(key, kinds[key], value) for key, value in values.items()})

    def as_dict(self, method: str) -> dict[str, Any]:
        """Plain values by name, for the ``summary.json`` of ``method``; only Kalman filters have ``process_noise``."""
        others = () if method.endswith("kalman_filter") else ("process_noise",)
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in others}
