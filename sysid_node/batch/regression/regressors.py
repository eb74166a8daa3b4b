"""The regressors of each coefficient, and how the air data's noise enters them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.batch.regression.errors_in_variables import SensorNoise, white_noise_variance
from sysid_node.batch.regression.measured_coefficients import MeasuredCoefficients, ReadingSensitivity
from sysid_node.errors import InputError
from sysid_node.flight.record import Array


def regressors_by_coefficient(
    aircraft: Aircraft, flights: Sequence[MeasuredCoefficients]
) -> dict[str, tuple[str, ...]]:
    """The aircraft file's regressors of each coefficient that can be formed in every flight.

    Raises InputError where there is no such coefficient.
    """
    formed = {
        name: aircraft.model_structure[name]
        for name in COEFFICIENTS
        if name in aircraft.model_structure and all(name in flight.coefficients for flight in flights)
    }
    if not formed:
        reasons = "; ".join(dict.fromkeys(remark for flight in flights for remark in flight.remarks))
        raise InputError(f"aircraft {aircraft.name}: no coefficient can be formed from these flights: {reasons}")
    return formed


def regressor_matrix(flight: MeasuredCoefficients, regressors: Sequence[str]) -> Array:
    """The regressors as columns (N, p)."""
    return np.column_stack([flight.regressors[name] for name in regressors])


def sensor_noises(
    time: Array,
    sensors: Mapping[str, tuple[Array, ReadingSensitivity]],
    coefficient: str,
    regressors: Sequence[str],
    cutoff: float,
) -> list[SensorNoise]:
    """Each air-data sensor's noise in the equation of one coefficient; its variance is read above ``cutoff`` Hz.

    ``sensors``: readings (N,) at ``time`` (N,) s and the equations' sensitivity to them, by sensor.
    """
    return [
        SensorNoise(
            white_noise_variance(time, reading, cutoff),
            sensitivity.coefficients[coefficient],
            np.column_stack([sensitivity.regressors[name] for name in regressors]),
        )
        for reading, sensitivity in sensors.values()
    ]
