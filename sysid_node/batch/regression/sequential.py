"""Regression in one pass along the flights, sample by sample or window by window.

The recursion's own covariance P (for residuals of unit variance) holds for white residuals and exact regressors. Both
are seldom so. The standard errors therefore come from the colour of the residuals (``coloured_residuals``), and from
the bias: by how much the values differ from those of equation error, which is filtered and corrected for the noise of
the regressors, with the same weights. The bias is not taken out, for the method would be another one then; it counts as
a further standard error (GUM: JCGM 100:2008, sec. F.2.4.5).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.coloured_residuals import coloured_covariance, spectral_degrees_of_freedom
from sysid_node.batch.regression.combined_fit import combined_fit
from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.batch.regression.errors_in_variables import (
    ErrorsInVariables,
    SensorNoise,
    corrected_normal_equations,
)
from sysid_node.batch.regression.filtering import lowpass, noise_gain
from sysid_node.batch.regression.linear_regression import Regression
from sysid_node.batch.regression.measured_coefficients import measured_coefficients, sensitivity_to_readings
from sysid_node.batch.regression.regressors import regressor_matrix, regressors_by_coefficient, sensor_noises
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.estimate import NORMAL_95, ParameterEstimate, confidence_interval
from sysid_node.batch.results.identifiability import (
    UnidentifiableGroups,
    identifiability_status,
    unidentifiable_groups,
)
from sysid_node.batch.settings import DEFAULT_LOW_PASS
from sysid_node.flight.record import Array, FlightRecord

#: Variance of the start values, as a multiple of the residual's: a diffuse prior.
_DIFFUSE = 1e8

#: Share of a derivative beyond which a bias leaves no valid estimate.
LARGEST_BIAS = 0.3

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
    method: str,
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    estimator: SequentialEstimator,
    memory: float = 1.0,
) -> BatchFit:
    """The fit of all coefficients, each by one pass of ``estimator`` along the flights, one after the other.

    ``memory``: the share of its weight that a sample keeps in a second. Raises InputError where the flights are too
    short, counting only what is below ``DEFAULT_LOW_PASS``: faster than the aircraft moves there is only noise.
    """
    flights = [measured_coefficients(aircraft, record) for record in records]
    sensors = [sensitivity_to_readings(aircraft, record) for record in records]
    step = float(np.median(np.diff(flights[0].time)))
    weights = sample_weights([flight.time for flight in flights], memory)
    regressions = {}
    for coefficient, regressors in regressors_by_coefficient(aircraft, flights).items():
        names = [f"{coefficient}_{name}" for name in regressors]
        effective_degrees_of_freedom(names, [flight.time for flight in flights], DEFAULT_LOW_PASS)
        data = _Data(
            names,
            [flight.time for flight in flights],
            [flight.coefficients[coefficient] for flight in flights],
            [regressor_matrix(flight, regressors) for flight in flights],
            weights,
            [
                sensor_noises(flight.time, readings, coefficient, regressors, DEFAULT_LOW_PASS)
                for flight, readings in zip(flights, sensors, strict=True)
            ],
        )
        values, inverse = estimator(names, np.concatenate(data.ys), np.concatenate(data.Xs), step)
        regressions[coefficient] = _assessed(data, values, inverse)
    return combined_fit(method, regressions, flights)


def sample_weights(times: Sequence[Array], memory: float) -> list[Array]:
    """Weights (N,) of the samples at ``times`` (N,) s of each flight; a share ``memory`` is kept in a second."""
    after = [sum(float(time[-1] - time[0]) for time in times[i + 1 :]) for i in range(len(times))]
    return [memory ** (time[-1] - time + later) for time, later in zip(times, after, strict=True)]


@dataclass(frozen=True)
class _Data:
    """One coefficient's regression: of each flight time (N,), y (N,), X (N, p), weights (N,), the sensors' noise."""

    names: Sequence[str]
    times: Sequence[Array]
    ys: Sequence[Array]
    Xs: Sequence[Array]
    weights: Sequence[Array]
    noises: Sequence[Sequence[SensorNoise]]


def _assessed(data: _Data, values: Array, inverse: Array) -> Regression:
    """The regression that estimated ``values`` (p,), with the ``inverse`` (p, p) of its information."""
    found = regression_from_values(data.names, values, inverse, data.ys, data.Xs)
    residuals = [y - m for y, m in zip(data.ys, found.modelled, strict=True)]
    scores = [X * weight[:, None] for X, weight in zip(data.Xs, data.weights, strict=True)]
    covariance = coloured_covariance(
        inverse, [X[:, None, :] for X in data.Xs], [r[:, None] for r in residuals], [Z[:, None, :] for Z in scores]
    )
    bias = values - _unbiased(data)
    freedom = spectral_degrees_of_freedom([r.size for r in residuals])
    errors = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    estimates = {
        name: _with_bias(estimate, float(error), float(off), freedom)
        for (name, estimate), error, off in zip(found.estimates.items(), errors, bias, strict=True)
    }
    return replace(found, estimates=estimates, covariance=covariance + np.diag(bias**2))


def _with_bias(estimate: ParameterEstimate, error: float, bias: float, freedom: float) -> ParameterEstimate:
    """The estimate with a standard ``error`` by noise and a ``bias``; not valid where the bias is most of it."""
    arm = (confidence_interval(0.0, error, freedom)[1] ** 2 + (NORMAL_95 * bias) ** 2) ** 0.5
    widened = replace(
        estimate,
        standard_error=float(np.hypot(error, bias)),
        lower=estimate.value - arm,
        upper=estimate.value + arm,
    )
    if estimate.valid and abs(bias) > max(2.0 * error, LARGEST_BIAS * abs(estimate.value - bias)):
        return widened.invalid(f"biased by about {bias:.2g}: noise on the regressors, or too slow to converge")
    return widened


def _unbiased(data: _Data) -> Array:
    """(p,) values by filtered least squares with the same weights, corrected for the noise of the regressors."""
    information, moment, errors = np.zeros((len(data.names), len(data.names))), np.zeros(len(data.names)), []
    for time, y, X, weight, noises in zip(data.times, data.ys, data.Xs, data.weights, data.noises, strict=True):
        Xf, yf = lowpass(time, X, DEFAULT_LOW_PASS), lowpass(time, y, DEFAULT_LOW_PASS)
        information += (Xf * weight[:, None]).T @ Xf
        moment += (Xf * weight[:, None]).T @ yf
        root = np.sqrt(weight)
        weighted = [
            replace(n, of_measured=root * n.of_measured, of_regressors=root[:, None] * n.of_regressors) for n in noises
        ]
        errors.append(ErrorsInVariables(Xf, noise_gain(time, DEFAULT_LOW_PASS), weighted))
    information, moment = corrected_normal_equations(information, moment, errors)
    scale = np.maximum(np.sqrt(np.abs(np.diag(information))), 1e-300)
    return np.asarray(np.linalg.lstsq(information / scale / scale[:, None], moment / scale, rcond=1e-12)[0] / scale)


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
