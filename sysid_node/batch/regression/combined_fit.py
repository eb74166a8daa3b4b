"""The regressions of all coefficients as one fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.names import split_derivative
from sysid_node.batch.regression.linear_regression import Regression
from sysid_node.batch.regression.measured_coefficients import (
    MeasuredCoefficients,
)
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.estimate import ParameterEstimate
from sysid_node.batch.results.identifiability import (
    identifiability_remarks,
)
from sysid_node.batch.results.response import ModelResponse


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
