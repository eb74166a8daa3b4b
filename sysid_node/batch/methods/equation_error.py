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
from sysid_node.aircraft.names import split_derivative
from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.batch.regression.errors_in_variables import ErrorsInVariables, SensorNoise, white_noise_variance
from sysid_node.batch.regression.filtering import lowpass
from sysid_node.batch.regression.linear_regression import Regression, regress
from sysid_node.batch.regression.measured_coefficients import (
    MeasuredCoefficients,
    ReadingSensitivity,
    formable_regressors,
    measured_coefficients,
    sensitivity_to_readings,
)
from sysid_node.batch.results.batch_fit import BatchFit, ModelResponse, ParameterEstimate
from sysid_node.batch.results.identifiability import identifiability_remarks
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord

#: Hz; well above the short period of a small aircraft, well below its sensors' bandwidth.
DEFAULT_LOW_PASS = 3.0


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


def _share_passed(time: Array, low_pass: float) -> float:
    """How much of white noise's variance the filter lets through."""
    impulse = np.zeros((time.size, 1))
    impulse[time.size // 2] = 1.0
    return float(np.sum(lowpass(time, impulse, low_pass) ** 2))


def regressors_by_coefficient(aircraft: Aircraft, flights: list[MeasuredCoefficients]) -> dict[str, tuple[str, ...]]:
    """Regressors by coefficient. Raises InputError where no coefficient can be formed."""
    structure = formable_regressors(aircraft, flights)
    if not structure:
        reasons = "; ".join(dict.fromkeys(remark for flight in flights for remark in flight.remarks))
        raise InputError(f"aircraft {aircraft.name}: no coefficient can be formed from these flights: {reasons}")
    return structure


def regressor_matrix(flight: MeasuredCoefficients, regressors: Sequence[str]) -> Array:
    """Regressors side by side (N, p)."""
    return np.column_stack([flight.regressors[name] for name in regressors])


def combined_fit(method: str, fits: Mapping[str, Regression], flights: Sequence[MeasuredCoefficients]) -> BatchFit:
    """The regressions of all coefficients as one Fit."""
    estimates = {
        name: _flagged_if_noise(estimate, flights) for fit in fits.values() for name, estimate in fit.estimates.items()
    }
    covariance = np.zeros((len(estimates), len(estimates)))
    first = 0
    for fit in fits.values():
        last = first + len(fit.estimates)
        covariance[first:last, first:last] = fit.covariance
        first = last
    noise = {coefficient: fit.noise for coefficient, fit in fits.items()}
    return BatchFit(
        method=method,
        estimates=estimates,
        covariance=covariance,
        noise=noise,
        log_det=float(2.0 * np.sum(np.log(np.maximum(list(noise.values()), 1e-300)))),
        responses=[
            ModelResponse(
                flight.name,
                flight.time,
                tuple(fits),
                np.column_stack([flight.coefficients[c] for c in fits]),
                np.column_stack([fit.modelled[k] for fit in fits.values()]),
            )
            for k, flight in enumerate(flights)
        ],
        converged=True,
        iterations=1,
        message="linear least squares",
        remarks=_remarks(fits, flights),
    )


def _flagged_if_noise(estimate: ParameterEstimate, flights: Sequence[MeasuredCoefficients]) -> ParameterEstimate:
    """Not valid where its regressor is mostly its sensor's noise: then it is biased towards zero, and sure of it."""
    _, regressor = split_derivative(estimate.name)
    noise = max((flight.noise.get(regressor, 0.0) for flight in flights), default=0.0)
    values = np.concatenate([flight.regressors[regressor] for flight in flights])
    if not estimate.valid or float(np.var(values)) >= 2.0 * noise**2:
        return estimate
    return replace(estimate, valid=False, status="not excited: its regressor is within the sensor's noise")


def _remarks(fits: Mapping[str, Regression], flights: Sequence[MeasuredCoefficients]) -> tuple[str, ...]:
    remarks = list(dict.fromkeys(remark for flight in flights for remark in flight.remarks))
    for fit in fits.values():
        remarks += identifiability_remarks(fit.covariance, list(fit.estimates), fit.lost)
    return tuple(remarks)
