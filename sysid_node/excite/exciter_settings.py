"""Settings of excitation in flight: the manoeuvre, the accuracy asked for, and the limits of the flight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sysid_node.errors import InputError


@dataclass(frozen=True)
class ExcitationSettings:
    """What is flown, to which accuracy, and within which limits. Raises InputError on impossible values."""

    manoeuvre: tuple[str, ...] = ("multisine:elevator,aileron,rudder:amplitude=0.02:length=15:low=0.15:high=1.9",)
    derivatives: tuple[str, ...] = ("Cm_alpha", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr")
    accuracy: float = 0.05  # statistical part of half the 95 % interval, over the size
    longest: float = 60.0  # s, after which it stops in any case
    watch: bool = False  # begin again when a derivative is no longer valid
    largest_amplitude: float = 0.1  # rad
    largest_roll: float = 0.9  # rad
    largest_pitch: float = 0.5  # rad
    least_airspeed: float = 0.7  # of the reference
    most_airspeed: float = 1.5
    least_load_factor: float = 0.0
    most_load_factor: float = 3.0

    def __post_init__(self) -> None:
        for name, (lower, upper) in RANGES.items():
            value = getattr(self, name)
            if not lower <= value <= upper:
                raise InputError(f"setting {name} = {value!r}: expected {lower:g} to {upper:g}")


#: Allowed values, both ends included.
RANGES: Mapping[str, tuple[float, float]] = {
    "accuracy": (0.001, 10.0),
    "longest": (1.0, 3600.0),
    "largest_amplitude": (0.0, 0.5),
    "largest_roll": (0.05, 1.5),
    "largest_pitch": (0.05, 1.5),
    "least_airspeed": (0.3, 1.0),
    "most_airspeed": (1.0, 3.0),
    "least_load_factor": (-5.0, 1.0),
    "most_load_factor": (1.0, 10.0),
}
