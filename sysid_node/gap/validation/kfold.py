"""k-fold validation: groups of windows, each predicted by a fit to the others, where no flight was held out.

A group may hold the only manoeuvre of its kind. Unknowns of which the others say little then stay near the aircraft
file, within their limits. The limits enter as bounds of the least-squares problem: cut off one by one, the unknowns
would no longer agree with what the other windows show.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.bounded_least_squares import bounded_least_squares
from sysid_node.gap.estimation.candidate_fit import CandidateFit, step_limits, stepped
from sysid_node.gap.estimation.predictive_density import (
    Evidence,
    FlightEvidence,
    can_be_divided,
    exported_parameters,
    whole_flight_evidence,
    window_groups,
    with_neighbours,
)
from sysid_node.gap.estimation.spectral_weights import amplitudes
from sysid_node.gap.instruments.liml import at_least_prior, moment_weights
from sysid_node.gap.instruments.moment_equations import prior_terms


def kfold_evidence(evidence: Evidence, fit: CandidateFit, *, filed: bool = False, held: Sequence[int] = ()) -> Evidence:
    """The evidence with each group's residuals and parameters by the other groups, from a fit of ``liml_estimate``.

    ``filed`` holds the nuisances where they are, ``held`` the candidates' parameters of these entries. The scores
    stay: they compare explanations of the same flights. Flights that cannot be divided are predicted by the fit to all
    of them.
    """
    if not can_be_divided(fit.models):
        return replace(evidence, flights=whole_flight_evidence(fit).flights)
    flights, steps = [], steps_without_groups(fit, filed=filed, held=held)
    for number, (flight, own) in enumerate(zip(fit.flights, steps, strict=True)):
        residual = amplitudes(flight.rows, flight.weights)
        for group, step in zip(window_groups(flight.model), own, strict=True):
            residual[group] = amplitudes(flight.rows[group] - flight.slopes[group] @ step, flight.weights)
        points = tuple(exported_parameters(fit, stepped(fit, step).flights[number].point) for step in own)
        flights.append(FlightEvidence(flight.model, residual, points))
    return replace(evidence, flights=tuple(flights))


def steps_without_groups(fit: CandidateFit, *, filed: bool = False, held: Sequence[int] = ()) -> Iterator[list[Array]]:
    """By flight: the steps (unknowns,) from the fit to that without each group of windows and its neighbours."""
    known, _ = moment_weights(fit)
    precision, far = prior_terms(fit)
    pairs = list(zip(known, fit.flights, strict=True))
    matrices = [np.einsum("wru,wrv->wuv", K, flight.slopes, optimize=True) for K, flight in pairs]
    scores = [np.einsum("wru,wr->wu", K, flight.rows) for K, flight in pairs]
    matrix = np.diag(precision) + sum(m.sum(axis=0) for m in matrices)
    score = -precision * far + sum(s.sum(axis=0) for s in scores)
    least, greatest = step_limits(fit)
    places = [fit.indices.index(i) for i in held]
    least[places] = greatest[places] = 0.0
    if filed:
        least[len(fit.indices) :] = greatest[len(fit.indices) :] = 0.0
    for model, own, right in zip(fit.models, matrices, scores, strict=True):
        asides = [with_neighbours(group, model.windows.count) for group in window_groups(model)]
        yield [
            bounded_least_squares(
                at_least_prior(matrix - own[a].sum(axis=0), precision), score - right[a].sum(axis=0), least, greatest
            )
            for a in asides
        ]
