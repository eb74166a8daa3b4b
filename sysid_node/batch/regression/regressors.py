"""Which regressors each coefficient has, and what sensor noise does to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.batch.regression.errors_in_variables import SensorNoise, white_noise_variance
from sysid_node.batch.regression.measured_coefficients import (
    MeasuredCoefficients,
    ReadingSensitivity,
)
from sysid_node.errors import InputError
from sysid_node.flight.record import Array


def regressors_by_coefficient(aircraft: Aircraft, flights: list[MeasuredCoefficients]) -> dict[str, tuple[str, ...]]:
    """Regressors by coefficient. Raises InputError where no coefficient can be formed."""
    structure = _formable_regressors(aircraft, flights)
    if not structure:
        reasons = "; ".join(dict.fromkeys(remark for flight in flights for remark in flight.remarks))
        raise InputError(f"aircraft {aircraft.name}: no coefficient can be formed from these flights: {reasons}")
    return structure


def _formable_regressors(aircraft: Aircraft, flights: list[MeasuredCoefficients]) -> dict[str, tuple[str, ...]]:
    """The aircraft's model as far as every flight can form it: regressors by coefficient."""
    return {
        name: aircraft.model_structure[name]
        for name in COEFFICIENTS
        if name in aircraft.model_structure and all(name in flight.coefficients for flight in flights)
    }


def regressor_matrix(flight: MeasuredCoefficients, regressors: Sequence[str]) -> Array:
    """Regressors side by side (N, p)."""
    return np.column_stack([flight.regressors[name] for name in regressors])


def sensor_noises(
    time: Array,
    sensors: Mapping[str, tuple[Array, ReadingSensitivity]],
    coefficient: str,
    regressors: Sequence[str],
    cutoff: float,
) -> list[SensorNoise]:
    """What each of the air data's noise does to one equation; its size as the readings show it above ``cutoff`` Hz."""
    return [
        SensorNoise(
            white_noise_variance(time, reading, cutoff),
            slope.coefficients[coefficient],
            np.column_stack([slope.regressors[name] for name in regressors]),
        )
        for reading, slope in sensors.values()
    ]
