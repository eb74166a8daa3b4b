"""Predictive density: how probable a fit makes flight data that it has not seen.

Each group of windows is predicted from the other windows (or, on a flight held out, from the flights fitted), with the
uncertainty of all that was fitted: a Gaussian about the fit, linearised (Rasmussen & Williams (2006), Gaussian
Processes for Machine Learning, eq. 2.12; eqs. 5.10 to 5.12 leave out one observation). Each group also bears its share
of the prior density at the fit: prediction from the other windows alone would favour an explanation that needs every
derivative two standard deviations away from the aircraft file.

Explanations are compared by these scores. A Bayesian bootstrap over the groups turns them into probabilities that are
no more certain than so many independent observations allow (Yao, Vehtari, Simpson & Gelman (2018), Bayesian
Analysis 13(3), "pseudo-BMA+").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.bounded_least_squares import solve
from sysid_node.gap.estimation.candidate_fit import CandidateFit, FlightFit, linearised, stepped
from sysid_node.gap.estimation.nuisances import DERIVATIVE_ERROR, HeldOutFlight, Nuisances
from sysid_node.gap.estimation.spectral_weights import (
    amplitudes,
    excess_squares,
    line_shares,
    noise_gradient,
    real_rows,
    residual_power,
    weights,
)
from sysid_node.gap.residuals.excited_axes import commanded_by_window, effective_number
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import Complex
from sysid_node.gap.thresholds import THRESHOLDS

#: Rounds in which the noise levels of a flight and the step of the unknowns are computed by turns.
_LEVEL_ROUNDS = 3


@dataclass(frozen=True)
class FlightEvidence:
    """A flight as it was predicted without having been seen.

    ``points`` are the parameters (P,) of the model that predicted each group of windows, as it is exported: clock
    offsets and biases within the noise belong to the recording, not to a simulator.
    """

    model: ResidualModel
    residual: Complex  # (W, L, 12)
    points: tuple[Array, ...]  # by group of windows

    @classmethod
    def throughout(cls, model: ResidualModel, point: Array) -> FlightEvidence:
        """The flight as the same parameters (P,) predict all of it."""
        return cls(model, model.residual(point), (point,) * len(window_groups(model)))


@dataclass(frozen=True)
class Evidence:
    """Log predictive densities (G,) of groups of windows, in nats, and the flights that they belong to."""

    scores: Array
    flights: tuple[FlightEvidence, ...]

    @property
    def total(self) -> float:
        """Sum of the scores, in nats."""
        return float(self.scores.sum())


def window_groups(model: ResidualModel) -> list[NDArray[np.intp]]:
    """Indices of the windows of each group; a group's windows are neighbours."""
    count = model.windows.count
    return list(np.array_split(np.arange(count), min(THRESHOLDS.evidence.groups, max(count // 2, 1))))


def with_neighbours(group: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """Indices of a group of windows and of those that overlap it, of ``count`` windows."""
    return np.arange(max(group[0] - 1, 0), min(group[-1] + 2, count))


def can_be_divided(models: Sequence[ResidualModel]) -> bool:
    """Whether each group of the flights' windows can be predicted from the others.

    Where the commands excite hardly more than one group, the others are quiet: without the only manoeuvre nothing can
    be fitted, and what is predicted of it from noise says nothing for or against an explanation.
    """
    groups = [commanded_by_window(model)[group].sum(axis=0) for model in models for group in window_groups(model)]
    return effective_number(np.array(groups)) > THRESHOLDS.evidence.excited * len(groups)


def whole_flight_evidence(fit: CandidateFit) -> Evidence:
    """Evidence of flights fitted that cannot be divided: the log evidence of all of them, by Laplace's approximation.

    The spectrum of the noise is profiled out. The groups of windows bear equal shares (MacKay (1992), Neural
    Computation 4(3), eq. 2.5).
    """
    assert fit.information is not None
    among = np.ix_(fit.uncertain, fit.uncertain)
    (_, after), (_, before) = (np.linalg.slogdet(each[among]) for each in (fit.information, fit.prior_information))
    flights = tuple(
        FlightEvidence(f.model, f.residual, (exported_parameters(fit, f.point),) * len(window_groups(f.model)))
        for f in fit.flights
    )
    count = sum(len(flight.points) for flight in flights)
    prior_score = fit.prior_score + fit.uncertain_log_widening  # ``before`` has the width of these priors already
    total = -0.5 * fit.spectral_deviance + prior_score - 0.5 * float(after - before)
    return Evidence(np.full(count, total / count), flights)


def cross_validated_evidence(fit: CandidateFit) -> Evidence:
    """Evidence of the flights fitted: each group of windows predicted from those that do not overlap it.

    Of flights that cannot be divided it is that of the whole.
    """
    assert fit.information is not None
    if not can_be_divided(fit.models):
        return whole_flight_evidence(fit)
    scores: list[float] = []
    flights: list[FlightEvidence] = []
    grams = [
        np.einsum("wru,wrv->wuv", f.slopes * fit.uncertain, f.slopes * fit.uncertain, optimize=True)
        for f in fit.flights
    ]
    whole = [gram.sum(axis=0) for gram in grams]
    elsewhere = [fit.prior_information + sum(w for k, w in enumerate(whole) if k != i) for i in range(len(whole))]
    for number, (flight, gram) in enumerate(zip(fit.flights, grams, strict=True)):
        model, slopes = flight.model, flight.slopes * fit.uncertain
        residual = amplitudes(flight.rows, flight.weights)
        predicted, points = residual.copy(), []
        for group in window_groups(model):
            aside = with_neighbours(group, model.windows.count)
            others = np.setdiff1d(np.arange(model.windows.count), aside)
            J, r = slopes[aside].reshape(-1, slopes.shape[2]), flight.rows[aside].ravel()
            information = elsewhere[number] + gram[others].sum(axis=0)
            pull = _noise_gradient(fit, number, flight.power, flight.point, aside.size)
            step = -solve(information, J.T @ r + pull)
            power = residual_power(model, residual[others], flight.point) if others.size > 2 else flight.power
            there = stepped(fit, step).flights[number].point
            pull = _noise_gradient(fit, number, power, there, group.size)
            part = _Group(model, flight.power, flight.rows[group], slopes[group], there, pull)
            score, predicted[group] = _predictive(part, power, step, information)
            scores.append(score)
            points.append(exported_parameters(fit, there))
        flights.append(FlightEvidence(model, predicted, tuple(points)))
    return Evidence(np.array(scores) + fit.prior_score / len(scores), tuple(flights))


def _noise_gradient(fit: CandidateFit, number: int, power: Array, point: Array, windows: int) -> Array:
    """Pull (unknowns,) of the regressors' noise in so many windows of one flight; zero on what is not uncertain."""
    pull, flight = np.zeros(fit.uncertain.size), fit.flights[number]
    entries = [*fit.indices, *flight.nuisances.indices]
    pull[fit.places_of(number, len(fit.indices))] = noise_gradient(flight.model, power, point, entries, windows)
    return np.asarray(pull * fit.uncertain)


def competing_evidence(fit: CandidateFit, held_out: Sequence[HeldOutFlight]) -> Evidence:
    """Evidence by which explanations are compared: of the flights fitted, cross-validated, and of flights held out.

    Nothing is fitted to flights held out, but they take part in the choice of the explanation.
    """
    fitted = cross_validated_evidence(fit)
    if not held_out:
        return fitted
    other = held_out_evidence(fit, held_out)
    scores = [part.scores - fit.prior_score / part.scores.size for part in (fitted, other)]
    both = np.concatenate(scores)
    return Evidence(both + fit.prior_score / both.size, fitted.flights + other.flights)


def _information_without_shapes(fit: CandidateFit) -> Array:
    """The information with those unknowns held that do not count as uncertain.

    A few windows may contain no information on a parameter that only shapes an effect (an onset, an angle), and a
    linear step of it would then lead anywhere.
    """
    assert fit.information is not None
    fixed = ~fit.uncertain
    information = fit.information * np.outer(fit.uncertain, fit.uncertain)
    information[fixed, fixed] = 1.0
    return np.asarray(information)


def held_out_evidence(fit: CandidateFit, held_out: Sequence[HeldOutFlight]) -> Evidence:
    """Evidence of flights that were not fitted.

    The fit's parameters and shared nuisances are kept; biases and clock offsets are each flight's own and unknown. So
    is the level of the noise: a flight in other air, or one that shows what no effect describes, is no more certain
    than what is left of it.
    """
    chosen, shared, _ = fit.sizes
    common = chosen + shared
    covariance = np.linalg.inv(_information_without_shapes(fit))[:common, :common]
    scores: list[float] = []
    flights: list[FlightEvidence] = []
    for flight in held_out:
        model, kept = flight.model, _kept_nuisances(fit, flight)
        point = transferred_parameters(fit, model)
        power = np.where(model.axes, np.maximum(_mean_power(fit, model), model.noise), 1.0)
        weight = weights(power)
        order = [*fit.indices, *_shared_first(kept)]
        rows = real_rows(model.residual(point), weight)
        slopes = real_rows(model.slopes(point, order), weight)
        slopes[..., :common] *= fit.uncertain[:common]
        information = np.zeros((len(order), len(order)))
        information[:common, :common] = np.linalg.inv(covariance)
        information[common:, common:] = np.diag(kept.sigma[~kept.shared] ** -2.0)
        beyond = excess_squares(model, power, point, model.windows.count)
        level, groups = noise_levels(rows, slopes, information, beyond), window_groups(model)
        for group in groups:
            pull = noise_gradient(model, power * level, point, order, group.size)
            pull[:common] *= fit.uncertain[:common]
            part = _Group(model, power, rows[group], slopes[group], point, pull)
            scores.append(_predictive(part, power * level, np.zeros(len(order)), information)[0])
        exported = exported_parameters(fit, point)
        flights.append(FlightEvidence(model, model.residual(point), (exported,) * len(groups)))
    return Evidence(np.array(scores) + fit.prior_score / len(scores), tuple(flights))


def noise_levels(rows: Array, slopes: Array, information: Array, beyond: Array) -> Array:
    """Power (12,) by channel of the noise of a flight that was not fitted, in multiples of that which its rows assume.

    ``rows`` (W, R) are its weighted residual, ``slopes`` (W, R, unknowns) those of all unknowns, of which
    ``information`` is known before. The levels are those at which the flight is most probable, the unknowns moving
    along (the scale of a normal linear model, profiled out: Seber & Lee (2003), Linear Regression Analysis, sect. 3.5).
    ``beyond`` (12,) is the part of the squares by noise beyond that at the file's parameters, which does not count.
    None is below one: how small noise can be is said by the fit.
    """
    J, r = slopes.reshape(-1, slopes.shape[2]), rows.ravel()
    channel = np.arange(r.size) % len(CHANNELS)
    count = np.bincount(channel, J.any(axis=1) | (r != 0.0), len(CHANNELS))
    level = np.ones(len(CHANNELS))
    for _ in range(_LEVEL_ROUNDS):
        weight = 1.0 / level[channel]
        step = solve(information + J.T @ (J * weight[:, None]), J.T @ (r * weight))
        squares = np.bincount(channel, (r - J @ step) ** 2, len(CHANNELS)) - beyond
        level = np.maximum(2.0 * squares / np.maximum(count, 1.0), 1.0)
    return level


def _shared_first(nuisances: Nuisances) -> list[int]:
    """Indices of the shared nuisance parameters, then of the flight's own."""
    indices = np.array(nuisances.indices)
    return [*indices[nuisances.shared].tolist(), *indices[~nuisances.shared].tolist()]


def _kept_nuisances(fit: CandidateFit, flight: HeldOutFlight) -> Nuisances:
    """A flight's nuisance parameters without those that the fit's candidates are or replace."""
    return flight.nuisances.without(fit.effects, flight.model.simulator.names, fit.widened)


def transferred_parameters(fit: CandidateFit, model: ResidualModel) -> Array:
    """Parameters (P,) of a flight that was not fitted: what is shared from the fit, its own nuisances neutral."""
    point = model.simulator.neutral()
    shared = [i for i, s in zip(fit.nuisances.indices, fit.nuisances.shared, strict=True) if s]
    transferred = [*fit.indices, *shared]
    point[transferred] = fit.flights[0].point[transferred]
    return np.asarray(point)


def fit_on_other_flight(fit: CandidateFit, flight: HeldOutFlight) -> CandidateFit:
    """The fit as it stands on a flight that it has not seen, linearised there; nothing is fitted anew."""
    model, point = flight.model, transferred_parameters(fit, flight.model)
    power = residual_power(model, model.residual(point), point)
    flight_fit = FlightFit(model, _kept_nuisances(fit, flight), point, power)
    return linearised(replace(fit, flights=(flight_fit,)))


def exported_parameters(fit: CandidateFit, point: Array) -> Array:
    """Parameters (P,) of the model that is handed on: the nuisances as in the file, except the aircraft's own.

    These are the derivatives' errors and the effects that the file states.
    """
    simulator, kept = fit.simulator, point.copy()
    aircraft = {DERIVATIVE_ERROR, *simulator.aircraft.effects}
    recording = [i for i in fit.nuisances.indices if simulator.parameters[i][0] not in aircraft]
    kept[recording] = simulator.neutral()[recording]
    return np.asarray(kept)


def _mean_power(fit: CandidateFit, model: ResidualModel) -> Array:
    """Mean residual power (L, 12) of the flights fitted, at the lines of another flight."""
    lines = model.windows.frequencies
    total = np.zeros((lines.size, len(CHANNELS)))
    for flight in fit.flights:
        fitted_lines = flight.model.windows.frequencies
        columns = [np.interp(lines, fitted_lines, flight.power[:, axis]) for axis in range(len(CHANNELS))]
        total += np.column_stack(columns)
    return np.asarray(total / len(fit.flights))


@dataclass(frozen=True)
class _Group:
    """A group of w windows: rows (w, R) and slopes (w, R, unknowns), both weighted by ``power`` (L, 12).

    ``point`` (P,) are the parameters with which it is predicted, ``pull`` (unknowns,) is that of the noise there.
    """

    model: ResidualModel
    power: Array
    rows: Array
    slopes: Array
    point: Array
    pull: Array


def _predictive(group: _Group, power: Array, step: Array, information: Array) -> tuple[float, Complex]:
    """Log predictive density of a group, and its residual (w, L, 12), after a step (unknowns,) of the unknowns.

    ``power`` (L, 12) is that of the noise; ``information`` that of the unknowns before the group is seen.
    """
    change = group.rows - group.slopes @ step
    windows, unknowns = group.rows.shape[0], group.slopes.shape[2]
    parts = change.reshape(windows, 2, -1, len(CHANNELS))
    scale = np.sqrt(group.power / power)
    scaled = (parts * scale).ravel()
    J = (group.slopes.reshape(*parts.shape, unknowns) * scale[..., None]).reshape(-1, unknowns)
    gained, right = information + J.T @ J, J.T @ scaled + group.pull
    _, before = np.linalg.slogdet(information)
    _, after = np.linalg.slogdet(gained)
    spread = windows * float(np.sum(line_shares(group.model) * np.log(power) * group.model.axes))
    squares = float(scaled @ scaled) - float(excess_squares(group.model, power, group.point, windows).sum())
    score = -0.5 * (spread + squares) + 0.5 * float(right @ solve(gained, right)) - 0.5 * (after - before)
    return score, amplitudes(change, weights(group.power))


def probabilities(scores: Sequence[Array], seed: int = 0) -> Array:
    """Probability of each explanation from its scores (G,) of the same groups: pseudo-BMA+."""
    table = np.array(scores)
    count = table.shape[1]
    draws = np.random.default_rng(seed).dirichlet(np.ones(count), THRESHOLDS.evidence.draws) * count
    totals = draws @ table.T
    totals -= totals.max(axis=1, keepdims=True)
    share = np.exp(totals)
    share /= share.sum(axis=1, keepdims=True)
    mean: Array = share.mean(axis=0)
    return mean
