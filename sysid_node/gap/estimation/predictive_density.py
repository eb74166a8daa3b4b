"""Evidence: how probable flight is that a fit has not seen, and the probabilities of explanations that follow.

Each group of windows is predicted from the others (or from the training flights), with the uncertainty of everything
that was fitted: a Gaussian about the fit, linearised (Rasmussen & Williams (2006), eq. 2.12; 5.10-5.12 leave out). What
the fit asks of the priors counts too, as a share of each group: prediction from the rest alone would forgive an
explanation that needs every derivative two sigmas out.
Explanations compete by these scores; a Bayesian bootstrap over the groups tempers them, so that probabilities mean no
more than so many independent observations can say (Yao, Vehtari, Simpson & Gelman (2018), Bayesian Analysis 13(3),
"pseudo-BMA+").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.fit import (
    CandidateFit,
    amplitudes,
    linearised,
    real_rows,
    residual_power,
    solve,
    stepped,
    weights,
)
from sysid_node.gap.estimation.nuisances import DERIVATIVE_ERROR, Nuisances
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import INDEPENDENT_SHARE, Complex
from sysid_node.gap.thresholds import THRESHOLDS


@dataclass(frozen=True)
class Evidence:
    """Scores (G,) of groups of windows not seen, and their residuals (W, L, 12) by flight.

    ``points`` are the parameters (P,) of the model that each group was predicted with, by flight and group, as it is
    written: a clock within a sample or a bias within the noise is the recording's, no simulator's.
    """

    scores: Array
    residuals: tuple[Complex, ...]
    models: tuple[ResidualModel, ...]
    points: tuple[tuple[Array, ...], ...]

    @property
    def total(self) -> float:
        """Sum of the scores, in nats."""
        return float(self.scores.sum())


def window_groups(model: ResidualModel) -> list[NDArray[np.intp]]:
    """Indices of the windows of each group, neighbours together."""
    count = model.windows.count
    return list(np.array_split(np.arange(count), min(THRESHOLDS.evidence.groups, max(count // 2, 1))))


def with_neighbours(group: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """A group of windows with those that overlap it, of so many."""
    return np.arange(max(group[0] - 1, 0), min(group[-1] + 2, count))


def cross_validated_evidence(fit: CandidateFit) -> Evidence:
    """Each group of windows predicted from the others of the same flights; windows that overlap it stand aside."""
    assert fit.information is not None
    scores: list[float] = []
    residuals: list[Complex] = []
    points: list[tuple[Array, ...]] = []
    grams = [np.einsum("wru,wrv->wuv", J * fit.loose, J * fit.loose, optimize=True) for J in fit.slopes]
    whole = [gram.sum(axis=0) for gram in grams]
    elsewhere = [fit.prior_information + sum(w for k, w in enumerate(whole) if k != i) for i in range(len(whole))]
    for i, (model, power, rows, full) in enumerate(zip(fit.models, fit.power, fit.rows, fit.slopes, strict=True)):
        slopes = full * fit.loose
        residual = amplitudes(rows, weights(model.windows, power))
        unseen, steps = residual.copy(), []
        for group in window_groups(model):
            aside = with_neighbours(group, model.windows.count)
            others = np.setdiff1d(np.arange(model.windows.count), aside)
            J, r = slopes[aside].reshape(-1, slopes.shape[2]), rows[aside].ravel()
            information = elsewhere[i] + grams[i][others].sum(axis=0)
            step = -solve(information, J.T @ r)
            steps.append(step)
            own_power = residual_power(model, residual[others]) if others.size > 2 else power
            score, part = _predictive(model, power, own_power, rows[group], slopes[group], step, information)
            scores.append(score)
            unseen[group] = part
        residuals.append(unseen)
        points.append(tuple(exported_parameters(fit, stepped(fit, step).points[i]) for step in steps))
    return Evidence(np.array(scores) + fit.prior_score / len(scores), tuple(residuals), fit.models, tuple(points))


def competing_evidence(fit: CandidateFit, unseen: Sequence[ResidualModel], nuisances: Sequence[Nuisances]) -> Evidence:
    """Evidence by which explanations compete: parts of the flights fitted, each predicted from the rest, and flights
    held out. Nothing is fitted to the latter, but they have a say in what is blamed."""
    own = cross_validated_evidence(fit)
    if not unseen:
        return own
    theirs = held_out_evidence(fit, unseen, nuisances)
    scores = [part.scores - fit.prior_score / part.scores.size for part in (own, theirs)]
    both = np.concatenate(scores)
    return Evidence(
        both + fit.prior_score / both.size,
        own.residuals + theirs.residuals,
        own.models + theirs.models,
        own.points + theirs.points,
    )


def _without_shapes(fit: CandidateFit) -> Array:
    """The information with what only shapes an effect (an onset, an angle) held where the fit put it.

    The data of a few windows may say nothing about such a parameter, and a linear step would then lead anywhere.
    """
    assert fit.information is not None
    held = ~fit.loose
    information = fit.information * np.outer(fit.loose, fit.loose)
    information[held, held] = 1.0
    return np.asarray(information)


def held_out_evidence(fit: CandidateFit, models: Sequence[ResidualModel], nuisances: Sequence[Nuisances]) -> Evidence:
    """Flights that the fit has not seen: its parameters and shared nuisances hold, biases and clocks are their own."""
    chosen, shared, _ = fit.sizes
    known = np.linalg.inv(_without_shapes(fit))[: chosen + shared, : chosen + shared]
    scores: list[float] = []
    residuals: list[Complex] = []
    points: list[tuple[Array, ...]] = []
    for model, theirs in zip(models, nuisances, strict=True):
        kept = theirs.without(fit.effects, model.simulator.names, fit.widened)
        point = transferred_parameters(fit, model)
        power = np.maximum(_train_power(fit, model), model.noise)
        power = np.where(model.axes, power, 1.0)
        weight = weights(model.windows, power)
        order = [*fit.indices, *_ordered(kept)]
        rows = real_rows(model.residual(point), weight)
        slopes = real_rows(model.slopes(point, order), weight)
        slopes[..., : chosen + shared] *= fit.loose[: chosen + shared]
        sigma = np.concatenate([kept.sigma[~kept.shared]])
        information = np.zeros((len(order), len(order)))
        information[: chosen + shared, : chosen + shared] = np.linalg.inv(known)
        information[chosen + shared :, chosen + shared :] = np.diag(sigma**-2.0)
        for group in window_groups(model):
            score, _ = _predictive(model, power, power, rows[group], slopes[group], np.zeros(len(order)), information)
            scores.append(score)
        residuals.append(model.residual(point))
        points.append((exported_parameters(fit, point),) * len(window_groups(model)))
    return Evidence(np.array(scores) + fit.prior_score / len(scores), tuple(residuals), tuple(models), tuple(points))


def _ordered(nuisances: Nuisances) -> list[int]:
    """Indices of the shared ones, then of the flight's own."""
    indices = np.array(nuisances.indices)
    return [*indices[nuisances.shared].tolist(), *indices[~nuisances.shared].tolist()]


def transferred_parameters(fit: CandidateFit, model: ResidualModel) -> Array:
    """The parameters of a flight not seen: what is shared from the fit, its own nuisances neutral."""
    point = model.simulator.neutral()
    shared = [i for i, s in zip(fit.nuisances.indices, fit.nuisances.shared, strict=True) if s]
    transferred_parameters = [*fit.indices, *shared]
    point[transferred_parameters] = fit.points[0][transferred_parameters]
    return np.asarray(point)


def fit_on_other_flight(fit: CandidateFit, model: ResidualModel, nuisances: Nuisances) -> CandidateFit:
    """The fit as it stands on a flight that it has not seen, all unknowns and their priors about there."""
    kept = nuisances.without(fit.effects, model.simulator.names, fit.widened)
    point = transferred_parameters(fit, model)
    power = residual_power(model, model.residual(point))
    return linearised(replace(fit, models=(model,), nuisances=kept, points=(point,), power=(power,)))


def exported_parameters(fit: CandidateFit, point: Array) -> Array:
    """The parameters (P,) of the model that is handed on: the nuisances neutral but for the derivatives' errors."""
    simulator, kept = fit.models[0].simulator, point.copy()
    own = [i for i in fit.nuisances.indices if simulator.parameters[i][0] != DERIVATIVE_ERROR]
    kept[own] = simulator.neutral()[own]
    return np.asarray(kept)


def _train_power(fit: CandidateFit, model: ResidualModel) -> Array:
    """Mean residual power of the flights fitted, at the lines of another."""
    lines = model.windows.frequencies
    total = np.zeros((lines.size, len(CHANNELS)))
    for known, power in zip(fit.models, fit.power, strict=True):
        own = known.windows.frequencies
        total += np.column_stack([np.interp(lines, own, power[:, axis]) for axis in range(len(CHANNELS))])
    return np.asarray(total / len(fit.models))


def _predictive(
    model: ResidualModel, power: Array, own_power: Array, rows: Array, slopes: Array, step: Array, information: Array
) -> tuple[float, Complex]:
    """Log probability of a group's rows, and its residual (w, L, 12), after a step of the unknowns.

    The rows are weighted by ``power``; the probability is that of ``own_power``.
    """
    change = rows - slopes @ step
    parts = change.reshape(rows.shape[0], 2, -1, len(CHANNELS))
    scale = np.sqrt(power / own_power)
    scaled = (parts * scale).ravel()
    J = (slopes.reshape(rows.shape[0], 2, -1, len(CHANNELS), slopes.shape[2]) * scale[..., None]).reshape(
        -1, slopes.shape[2]
    )
    gained, right = information + J.T @ J, J.T @ scaled
    _, before = np.linalg.slogdet(information)
    _, after = np.linalg.slogdet(gained)
    lines = np.ones(power.shape[0])
    lines[0] = 0.5
    spread = INDEPENDENT_SHARE * rows.shape[0] * float(np.sum(lines[:, None] * np.log(own_power) * model.axes))
    score = -spread - 0.5 * float(scaled @ scaled) + 0.5 * float(right @ solve(gained, right)) - 0.5 * (after - before)
    return score, amplitudes(change, weights(model.windows, power))


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
