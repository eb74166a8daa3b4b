"""A fit to simulated flights as an aircraft: its derivatives and effects, with their own standard errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import DELAY_EFFECTS, Aircraft, Derivative, UncertainValue
from sysid_node.flight.record import Array
from sysid_node.gap.estimation.bounded_least_squares import solve
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.nuisances import CLOCKS, DERIVATIVE_ERROR, believed_effects
from sysid_node.gap.estimation.predictive_density import window_groups
from sysid_node.sim.model.parameters import stated_parameters

#: Least tolerance of an estimate, as a share of its plausible size: a tolerance of zero would mean "not known".
_LEAST_SHARE = 1e-3

#: Clock offset below which a topic's stamps count as prompt, s.
_PROMPT = 1e-3


def estimated_aircraft(file: Aircraft, fit: CandidateFit) -> Aircraft:
    """The aircraft that the fit of simulated flights describes.

    Everything but derivatives, effects, delays and tables is the file's: geometry, mass, controls, and the noise of the
    real sensors.
    """
    covariance = standard_covariance(fit)
    point, names = fit.flights[0].point, fit.simulator.names
    guess = fit.simulator.aircraft
    places = _places(fit)
    derivatives = {}
    for name, known in guess.derivatives.items():
        index = names.index(f"{DERIVATIVE_ERROR}.{name}")
        error = np.sqrt(covariance[places[index], places[index]]) if index in places else known.tolerance or 0.0
        least = _LEAST_SHARE * max(abs(float(known.value + point[index])), 0.1 * (known.tolerance or 0.0))
        derivatives[name] = Derivative(float(known.value + point[index]), max(float(error), least))
    effects, delays = _effects(file, fit, covariance, places)
    return replace(
        file,
        source=f"identified from simulated flights, beginning with the file of {file.name}; {file.source}".rstrip("; "),
        derivatives=derivatives,
        effects=effects,
        delays=delays,
        tables=guess.tables,
    )


def _places(fit: CandidateFit) -> dict[int, int]:
    """Place among the unknowns by entry of the parameter vector: of the candidates, and of the shared nuisances."""
    shared = [i for i, s in zip(fit.nuisances.indices, fit.nuisances.shared, strict=True) if s]
    return {index: place for place, index in enumerate([*fit.indices, *shared])}


def standard_covariance(fit: CandidateFit) -> Array:
    """Covariance (unknowns, unknowns) of a fit: the inverse of its information, or the jackknife's where that is more.

    A simulator's flights have hardly any noise; what a model leaves of them is systematic. The jackknife leaves out one
    group of windows after another, and shows how far the estimates depend on which part of the flights was fitted
    (Efron (1982), The Jackknife, the Bootstrap and Other Resampling Plans, sect. 3.1).
    """
    assert fit.information is not None
    steps: list[Array] = []
    for flight in fit.flights:
        for group in window_groups(flight.model):
            J = flight.slopes[group].reshape(-1, flight.slopes.shape[2])
            less = fit.information - J.T @ J
            spread = np.maximum(np.diag(less), 1e-300) ** -0.5
            scaled = less * np.outer(spread, spread) + 1e-9 * np.eye(spread.size)
            steps.append(-spread * solve(scaled, spread * (J.T @ flight.rows[group].ravel())))
    deviations = np.array(steps) - np.mean(steps, axis=0)
    jackknife = (len(steps) - 1.0) / len(steps) * deviations.T @ deviations
    scale = np.sqrt(np.maximum(np.diag(jackknife) / np.diag(fit.covariance), 1.0))
    return np.asarray(fit.covariance * np.outer(scale, scale))


def _effects(
    file: Aircraft, fit: CandidateFit, covariance: Array, places: Mapping[int, int]
) -> tuple[dict[str, dict[str, UncertainValue]], dict[str, UncertainValue]]:
    """Effects and delays: the file's, with what was fitted in their place, and the clock offsets found."""
    simulator, point = fit.simulator, fit.flights[0].point
    stated = {effect: dict(values) for effect, values in file.effects.items()}
    moved = {simulator.names.index(name) for name in believed_effects(simulator)}
    fitted = {*fit.indices, *(moved & set(fit.nuisances.indices))}
    for effect in dict.fromkeys(simulator.parameters[i][0] for i in sorted(fitted)):
        for name, parameter in stated_parameters(simulator.layout, effect).items():
            entries = [i for i in parameter.entries if i in fitted]
            value = parameter.value(point)
            if not entries or not np.isfinite(value):
                continue
            if value == 0.0 and len(parameter.entries) > 1:
                stated.get(effect, {}).pop(name, None)
                continue
            error = _error(entries, covariance, places)
            error *= value**2 if parameter.inverse else 1.0
            stated.setdefault(effect, {})[name] = UncertainValue(value, max(error, _LEAST_SHARE * abs(value)))
    delays = dict(file.delays)
    for topic, effect in DELAY_EFFECTS.items():
        index = simulator.names.index(f"{effect}.delay")
        of_clock = effect in CLOCKS and index in fit.nuisances.indices and abs(point[index]) > _PROMPT
        if effect in stated or of_clock:
            error = _error([index], covariance, places) if index in places else 0.0
            delays[topic] = UncertainValue(float(point[index]), max(error, _PROMPT))
            stated.pop(effect, None)
    return {effect: values for effect, values in stated.items() if values}, delays


def _error(entries: Sequence[int], covariance: Array, places: Mapping[int, int]) -> float:
    """Standard error of the sum of entries of the parameter vector."""
    chosen = [places[i] for i in entries if i in places]
    return float(np.sqrt(max(covariance[np.ix_(chosen, chosen)].sum(), 0.0)))
