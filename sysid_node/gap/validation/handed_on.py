"""What is handed on of a fit: the corrected file, which has the aircraft file's effects as stated but for the causes.

A fit moves the file's effects within their tolerances, so that an honest error of them is not taken for a cause. That
is no finding: the corrected file keeps what was stated. The gap that is stated is that of this file.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.predictive_density import (
    Evidence,
    FlightEvidence,
    transferred_parameters,
    window_groups,
)
from sysid_node.gap.residuals.residual_model import ResidualModel


def with_stated_effects(fit: CandidateFit, point: Array) -> Array:
    """Parameters (P,) with the aircraft file's effects as it states them where they are nuisances of the fit."""
    simulator, kept = fit.simulator, point.copy()
    effects = [i for i in fit.nuisances.indices if simulator.parameters[i][0] in simulator.aircraft.effects]
    kept[effects] = simulator.neutral()[effects]
    return np.asarray(kept)


def corrected_parameters(fit: CandidateFit, model: ResidualModel) -> Array:
    """Parameters (P,) of the corrected file on a flight, with the clock offsets that all flights share."""
    return with_stated_effects(fit, transferred_parameters(fit, model))


def of_corrected_file(evidence: Evidence, fit: CandidateFit) -> Evidence:
    """The evidence with the flights as the corrected file predicts them; the same where the fit moved no stated effect.

    The scores stay: they compare explanations.
    """
    flights = tuple(_as_corrected(flight, fit) for flight in evidence.flights)
    same = all(new is old for new, old in zip(flights, evidence.flights, strict=True))
    return evidence if same else replace(evidence, flights=flights)


def _as_corrected(flight: FlightEvidence, fit: CandidateFit) -> FlightEvidence:
    """A flight with its parameters, and the residual changed by what the stated effects change of it."""
    points = tuple(with_stated_effects(fit, point) for point in flight.points)
    if all(np.array_equal(*pair) for pair in zip(points, flight.points, strict=True)):
        return flight
    residual = flight.residual.copy()
    for group, new, old in zip(window_groups(flight.model), points, flight.points, strict=True):
        residual[group] += (flight.model.residual(new) - flight.model.residual(old))[group]
    return replace(flight, points=points, residual=residual)
