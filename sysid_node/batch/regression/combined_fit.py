"""The regressions of all coefficients combined into one fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sysid_node.aircraft.names import split_derivative
from sysid_node.batch.regression.linear_regression import Regression
from sysid_node.batch.regression.measured_coefficients import MeasuredCoefficients
from sysid_node.batch.results.batch_fit import BatchFit, SearchEnd
from sysid_node.batch.results.estimate import ParameterEstimate
from sysid_node.batch.results.identifiability import identifiability_remarks
from sysid_node.batch.results.response import ModelResponse
from sysid_node.flight.record import Array


def combined_fit(
    method: str, regressions: Mapping[str, Regression], flights: Sequence[MeasuredCoefficients]
) -> BatchFit:
    """The fit made of the regressions of each coefficient; different coefficients are uncorrelated."""
    estimates = {
        name: _checked_against_noise(estimate, flights)
        for regression in regressions.values()
        for name, estimate in regression.estimates.items()
    }
    noise = {coefficient: regression.noise for coefficient, regression in regressions.items()}
    return BatchFit(
        method=method,
        estimates=estimates,
        covariance=_block_diagonal([regression.covariance for regression in regressions.values()]),
        noise=noise,
        log_det=float(2.0 * np.sum(np.log(np.maximum(list(noise.values()), 1e-300)))),
        responses=[_response(regressions, flight, k) for k, flight in enumerate(flights)],
        search=SearchEnd(converged=True, iterations=1, message="linear least squares"),
        remarks=_remarks(regressions, flights),
    )


def _block_diagonal(blocks: Sequence[Array]) -> Array:
    size = sum(len(block) for block in blocks)
    whole, first = np.zeros((size, size)), 0
    for block in blocks:
        last = first + len(block)
        whole[first:last, first:last] = block
        first = last
    return whole


def _response(regressions: Mapping[str, Regression], flight: MeasuredCoefficients, index: int) -> ModelResponse:
    """Measured and modelled coefficients of the flight with this index."""
    measured = np.column_stack([flight.coefficients[coefficient] for coefficient in regressions])
    modelled = np.column_stack([regression.modelled[index] for regression in regressions.values()])
    return ModelResponse(flight.name, flight.time, tuple(regressions), measured, modelled)


def _checked_against_noise(estimate: ParameterEstimate, flights: Sequence[MeasuredCoefficients]) -> ParameterEstimate:
    """The estimate, marked invalid where its regressor varies little more than its sensor's noise.

    Noise on the regressor biases such an estimate towards zero, and its standard error does not show it.
    """
    _, regressor = split_derivative(estimate.name)
    noise = max((flight.noise.get(regressor, 0.0) for flight in flights), default=0.0)
    values = np.concatenate([flight.regressors[regressor] for flight in flights])
    if not estimate.valid or float(np.var(values)) >= 2.0 * noise**2:
        return estimate
    return estimate.invalid("not excited: its regressor is within the sensor's noise")


def _remarks(regressions: Mapping[str, Regression], flights: Sequence[MeasuredCoefficients]) -> tuple[str, ...]:
    remarks = list(dict.fromkeys(remark for flight in flights for remark in flight.remarks))
    for regression in regressions.values():
        remarks += identifiability_remarks(regression.covariance, list(regression.estimates), regression.unidentifiable)
    return tuple(remarks)
