"""Equation error in the time domain: each coefficient regressed on what should explain it, at every sample.

Klein & Morelli (2006), ch. 5. No model is integrated, no start values are needed, and turbulence does not bias it;
noise on the regressors (the flow angles') does, towards zero. Both sides are low-pass filtered first, which leaves the
constants as they are and most of that noise behind.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.combined_fit import combined_fit
from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.batch.regression.errors_in_variables import ErrorsInVariables
from sysid_node.batch.regression.filtering import lowpass
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

    ``low_pass`` Hz bounds what is used of the signals; 0 uses all. Raises InputError where signals are missing.
    """
    flights = [measured_coefficients(aircraft, record) for record in records]
    sensors = [sensitivity_to_readings(aircraft, record) for record in records]
    fits = {
        coefficient: _fit(coefficient, regressors, flights, sensors, low_pass)
        for coefficient, regressors in regressors_by_coefficient(aircraft, flights).items()
    }
    return combined_fit("equation_error", fits, flights)


def _fit(
    coefficient: str,
    regressors: Sequence[str],
    flights: Sequence[MeasuredCoefficients],
    sensors: Sequence[Mapping[str, tuple[Array, ReadingSensitivity]]],
    low_pass: float,
) -> Regression:
    names = [f"{coefficient}_{name}" for name in regressors]
    ys = [lowpass(flight.time, flight.coefficients[coefficient], low_pass) for flight in flights]
    Xs = [regressor_matrix(flight, regressors) for flight in flights]
    passed = [lowpass(flight.time, X, low_pass) for flight, X in zip(flights, Xs, strict=True)]
    noisy = [
        ErrorsInVariables(
            lowpass(flight.time, X, low_pass),
            _share_passed(flight.time, low_pass),
            sensor_noises(flight.time, of_sensors, coefficient, regressors, low_pass),
        )
        for flight, X, of_sensors in zip(flights, passed, sensors, strict=True)
    ]
    fit = regress(
        names,
        ys,
        passed,
        None,
        effective_degrees_of_freedom(names, [flight.time for flight in flights], low_pass),
        noisy,
    )
    values = np.array([estimate.value for estimate in fit.estimates.values()])
    return replace(fit, modelled=[X @ values for X in Xs])


def _share_passed(time: Array, low_pass: float) -> float:
    """How much of white noise's variance the filter lets through."""
    impulse = np.zeros((time.size, 1))
    impulse[time.size // 2] = 1.0
    return float(np.sum(lowpass(time, impulse, low_pass) ** 2))
