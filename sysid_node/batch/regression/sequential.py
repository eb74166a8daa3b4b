"""Regression in one pass along the flights, sample by sample or window by window."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.combined_fit import combined_fit
from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.batch.regression.linear_regression import Regression
from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.batch.regression.regressors import regressor_matrix, regressors_by_coefficient
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.estimate import ParameterEstimate, confidence_interval
from sysid_node.batch.results.identifiability import (
    UnidentifiableGroups,
    identifiability_status,
    unidentifiable_groups,
)
from sysid_node.batch.settings import DEFAULT_LOW_PASS
from sysid_node.flight.record import Array, FlightRecord

#: Variance of the start values, as a multiple of the residual's: a diffuse prior.
_DIFFUSE = 1e8

#: ``(names, y (N,), X (N, p), step s) -> values (p,), covariance (p, p)``: one pass along the flights.
SequentialEstimator = Callable[[Sequence[str], Array, Array, float], tuple[Array, Array]]


def recursive_estimate(
    y: Array, X: Array, forgetting: float, filtered: Callable[[float], float]
) -> tuple[Array, Array]:
    """Values (p,) and covariance (p, p), for residuals of unit variance, by recursive least squares of ``y`` on ``X``.

    ``forgetting`` is the weight that a sample keeps from one to the next. ``filtered`` is applied to each prediction
    error before it corrects the values. Ljung & Soederstrom (1983), eq. 2.20.
    """
    values, P = np.zeros(X.shape[1]), _DIFFUSE * np.eye(X.shape[1])
    for row, measured in zip(X, y, strict=True):
        Px = P @ row
        gain = Px / (forgetting + row @ Px)
        values = values + gain * filtered(float(measured - row @ values))
        P = (P - np.outer(gain, Px)) / forgetting
        P = 0.5 * (P + P.T)
    return values, P


def sequential_fit(
    method: str, aircraft: Aircraft, records: Sequence[FlightRecord], estimator: SequentialEstimator
) -> BatchFit:
    """The fit of all coefficients, each by one pass of ``estimator`` along the flights, one after the other.

    Raises InputError where the flights are too short, counting only what is below ``DEFAULT_LOW_PASS``: faster than the
    aircraft moves there is only noise.
    """
    flights = [measured_coefficients(aircraft, record) for record in records]
    step = float(np.median(np.diff(flights[0].time)))
    regressions = {}
    for coefficient, regressors in regressors_by_coefficient(aircraft, flights).items():
        names = [f"{coefficient}_{name}" for name in regressors]
        effective_degrees_of_freedom(names, [flight.time for flight in flights], DEFAULT_LOW_PASS)
        Xs = [regressor_matrix(flight, regressors) for flight in flights]
        ys = [flight.coefficients[coefficient] for flight in flights]
        values, covariance = estimator(names, np.concatenate(ys), np.concatenate(Xs), step)
        regressions[coefficient] = regression_from_values(names, values, covariance, ys, Xs)
    return combined_fit(method, regressions, flights)


def regression_from_values(
    names: Sequence[str], values: Array, covariance: Array, ys: Sequence[Array], Xs: Sequence[Array]
) -> Regression:
    """The regression that estimated ``values`` (p,); ``covariance`` (p, p) is for residuals of unit variance."""
    modelled = [X @ values for X in Xs]
    residual = np.concatenate([y - m for y, m in zip(ys, modelled, strict=True)])
    noise = float(np.sqrt(np.mean(residual**2)))
    unidentifiable = unidentifiable_groups(np.asarray(sum(X.T @ X for X in Xs)), names)
    errors = noise * np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    freedom = float(residual.size - len(names))
    estimates = {
        name: _estimate(name, float(value), float(error), freedom, unidentifiable)
        for name, value, error in zip(names, values, errors, strict=True)
    }
    return Regression(estimates, noise**2 * covariance, modelled, noise, unidentifiable)


def _estimate(
    name: str, value: float, error: float, freedom: float, unidentifiable: UnidentifiableGroups
) -> ParameterEstimate:
    status = identifiability_status(name, unidentifiable)
    lower, upper = confidence_interval(value, error, freedom)
    return ParameterEstimate(name, value, error, lower, upper, status == "ok", status, error)
