"""Equation error in the time domain: each coefficient is regressed on its regressors, at every sample.

Klein & Morelli, "Aircraft System Identification" (2006), ch. 5. No model is integrated, no start values are needed, and
the motion of the air does not bias it. Noise on the regressors, those of the flow angles above all, biases it towards
zero. Both sides are low-pass filtered first, which leaves the parameters as they are and removes most of that noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.combined_fit import combined_fit
from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.batch.regression.errors_in_variables import ErrorsInVariables
from sysid_node.batch.regression.filtering import lowpass, noise_gain
from sysid_node.batch.regression.linear_regression import Regression, regress
from sysid_node.batch.regression.measured_coefficients import (
    MeasuredCoefficients,
    ReadingSensitivity,
    measured_coefficients,
    sensitivity_to_readings,
)
from sysid_node.batch.regression.regressors import regressor_matrix, regressors_by_coefficient, sensor_noises
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.settings import DEFAULT_LOW_PASS
from sysid_node.flight.record import Array, FlightRecord


def equation_error(aircraft: Aircraft, records: Sequence[FlightRecord], low_pass: float = DEFAULT_LOW_PASS) -> BatchFit:
    """The aircraft file's derivatives from all flights together.

    The signals are used below ``low_pass`` Hz; 0 uses all of them. Raises InputError where signals are missing.
    """
    flights = [measured_coefficients(aircraft, record) for record in records]
    sensors = [sensitivity_to_readings(aircraft, record) for record in records]
    regressions = {
        coefficient: _regression(coefficient, regressors, flights, sensors, low_pass)
        for coefficient, regressors in regressors_by_coefficient(aircraft, flights).items()
    }
    return combined_fit("equation_error", regressions, flights)


def _regression(
    coefficient: str,
    regressors: Sequence[str],
    flights: Sequence[MeasuredCoefficients],
    sensors: Sequence[Mapping[str, tuple[Array, ReadingSensitivity]]],
    low_pass: float,
) -> Regression:
    """The regression of one coefficient on filtered signals; what it models is not filtered."""
    names = [f"{coefficient}_{name}" for name in regressors]
    ys = [lowpass(flight.time, flight.coefficients[coefficient], low_pass) for flight in flights]
    Xs = [regressor_matrix(flight, regressors) for flight in flights]
    filtered = [lowpass(flight.time, X, low_pass) for flight, X in zip(flights, Xs, strict=True)]
    sensor_errors = [
        ErrorsInVariables(
            lowpass(flight.time, X, low_pass),
            noise_gain(flight.time, low_pass),
            sensor_noises(flight.time, sensitivities, coefficient, regressors, low_pass),
        )
        for flight, X, sensitivities in zip(flights, filtered, sensors, strict=True)
    ]
    freedom = effective_degrees_of_freedom(names, [flight.time for flight in flights], low_pass)
    regression = regress(names, ys, filtered, None, freedom, sensor_errors)
    values = np.array([estimate.value for estimate in regression.estimates.values()])
    return replace(regression, modelled=[X @ values for X in Xs])
