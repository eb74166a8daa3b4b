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
    Fit,
    amplitudes,
    linearised,
    moved,
    real_rows,
    residual_power,
    solve,
    weights,
)
from sysid_node.gap.estimation.nuisances import WIDENED, Nuisances
from sysid_node.gap.residuals.residual_model import CHANNELS, View
from sysid_node.gap.residuals.windowed_spectra import SHARE, Complex

#: Draws of the Bayesian bootstrap.
_DRAWS = 2000

#: Groups of windows that a flight is parted into, at most.
_GROUPS = 8


@dataclass(frozen=True)
class Evidence:
    """Scores (G,) of groups of windows not seen, and their residuals (W, L, 12) by flight.

    ``points`` are the parameters (P,) of the model that each group was predicted with, by flight and group, as it is
    written: a clock within a sample or a bias within the noise is the recording's, no simulator's.
    """

    scores: Array
    residuals: tuple[Complex, ...]
    views: tuple[View, ...]
    points: tuple[tuple[Array, ...], ...]

    @property
    def total(self) -> float:
        """Sum of the scores, in nats."""
        return float(self.scores.sum())


def groups_of(view: View) -> list[NDArray[np.intp]]:
    """Indices of the windows of each group, neighbours together."""
    return list(np.array_split(np.arange(view.windows.count), min(_GROUPS, max(view.windows.count // 2, 1))))


def beside(group: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """A group of windows with those that overlap it, of so many."""
    return np.arange(max(group[0] - 1, 0), min(group[-1] + 2, count))


def cross_validated(fit: Fit) -> Evidence:
    """Each group of windows predicted from the others of the same flights; windows that overlap it stand aside."""
    assert fit.information is not None
    scores: list[float] = []
    residuals: list[Complex] = []
    points: list[tuple[Array, ...]] = []
    grams = [np.einsum("wru,wrv->wuv", J * fit.loose, J * fit.loose, optimize=True) for J in fit.slopes]
    whole = [gram.sum(axis=0) for gram in grams]
    elsewhere = [fit.prior_information + sum(w for k, w in enumerate(whole) if k != i) for i in range(len(whole))]
    for i, (view, power, rows, full) in enumerate(zip(fit.views, fit.power, fit.rows, fit.slopes, strict=True)):
        slopes = full * fit.loose
        residual = amplitudes(rows, weights(view.windows, power))
        unseen, steps = residual.copy(), []
        for group in groups_of(view):
            aside = beside(group, view.windows.count)
            others = np.setdiff1d(np.arange(view.windows.count), aside)
            J, r = slopes[aside].reshape(-1, slopes.shape[2]), rows[aside].ravel()
            information = elsewhere[i] + grams[i][others].sum(axis=0)
            step = -solve(information, J.T @ r)
            steps.append(step)
            own_power = residual_power(view, residual[others]) if others.size > 2 else power
            score, part = _predictive(view, power, own_power, rows[group], slopes[group], step, information)
            scores.append(score)
            unseen[group] = part
        residuals.append(unseen)
        points.append(tuple(written(fit, moved(fit, step).points[i]) for step in steps))
    return Evidence(np.array(scores) + fit.prior_score / len(scores), tuple(residuals), fit.views, tuple(points))


def judged(fit: Fit, unseen: Sequence[View], nuisances: Sequence[Nuisances]) -> Evidence:
    """Evidence by which explanations compete: parts of the flights fitted, each predicted from the rest, and flights
    held out. Nothing is fitted to the latter, but they have a say in what is blamed."""
    own = cross_validated(fit)
    if not unseen:
        return own
    theirs = held_out(fit, unseen, nuisances)
    scores = [part.scores - fit.prior_score / part.scores.size for part in (own, theirs)]
    both = np.concatenate(scores)
    return Evidence(
        both + fit.prior_score / both.size,
        own.residuals + theirs.residuals,
        own.views + theirs.views,
        own.points + theirs.points,
    )


def _without_shapes(fit: Fit) -> Array:
    """The information with what only shapes an effect (an onset, an angle) held where the fit put it.

    The data of a few windows may say nothing about such a parameter, and a linear step would then lead anywhere.
    """
    assert fit.information is not None
    held = ~fit.loose
    information = fit.information * np.outer(fit.loose, fit.loose)
    information[held, held] = 1.0
    return np.asarray(information)


def held_out(fit: Fit, views: Sequence[View], nuisances: Sequence[Nuisances]) -> Evidence:
    """Flights that the fit has not seen: its parameters and shared nuisances hold, biases and clocks are their own."""
    chosen, shared, _ = fit.sizes
    known = np.linalg.inv(_without_shapes(fit))[: chosen + shared, : chosen + shared]
    scores: list[float] = []
    residuals: list[Complex] = []
    points: list[tuple[Array, ...]] = []
    for view, theirs in zip(views, nuisances, strict=True):
        kept = theirs.without(fit.effects, view.simulator.names, fit.widened)
        point = carried(fit, view)
        power = np.maximum(_train_power(fit, view), view.noise)
        power = np.where(view.axes, power, 1.0)
        weight = weights(view.windows, power)
        order = [*fit.indices, *_ordered(kept)]
        rows = real_rows(view.residual(point), weight)
        slopes = real_rows(view.slopes(point, order), weight)
        slopes[..., : chosen + shared] *= fit.loose[: chosen + shared]
        sigma = np.concatenate([kept.sigma[~kept.shared]])
        information = np.zeros((len(order), len(order)))
        information[: chosen + shared, : chosen + shared] = np.linalg.inv(known)
        information[chosen + shared :, chosen + shared :] = np.diag(sigma**-2.0)
        for group in groups_of(view):
            score, _ = _predictive(view, power, power, rows[group], slopes[group], np.zeros(len(order)), information)
            scores.append(score)
        residuals.append(view.residual(point))
        points.append((written(fit, point),) * len(groups_of(view)))
    return Evidence(np.array(scores) + fit.prior_score / len(scores), tuple(residuals), tuple(views), tuple(points))


def _ordered(nuisances: Nuisances) -> list[int]:
    """Indices of the shared ones, then of the flight's own."""
    indices = np.array(nuisances.indices)
    return [*indices[nuisances.shared].tolist(), *indices[~nuisances.shared].tolist()]


def carried(fit: Fit, view: View) -> Array:
    """The parameters of a flight not seen: what is shared from the fit, its own nuisances neutral."""
    point = view.simulator.neutral()
    shared = [i for i, s in zip(fit.nuisances.indices, fit.nuisances.shared, strict=True) if s]
    carried = [*fit.indices, *shared]
    point[carried] = fit.points[0][carried]
    return np.asarray(point)


def upon(fit: Fit, view: View, nuisances: Nuisances) -> Fit:
    """The fit as it stands on a flight that it has not seen, all unknowns and their priors about there."""
    kept = nuisances.without(fit.effects, view.simulator.names, fit.widened)
    point = carried(fit, view)
    power = residual_power(view, view.residual(point))
    return linearised(replace(fit, views=(view,), nuisances=kept, points=(point,), power=(power,)))


def written(fit: Fit, point: Array) -> Array:
    """The parameters (P,) of the model that is handed on: the nuisances neutral but for the derivatives' errors."""
    simulator, kept = fit.views[0].simulator, point.copy()
    own = [i for i in fit.nuisances.indices if simulator.parameters[i][0] != WIDENED]
    kept[own] = simulator.neutral()[own]
    return np.asarray(kept)


def _train_power(fit: Fit, view: View) -> Array:
    """Mean residual power of the flights fitted, at the lines of another."""
    lines = view.windows.frequencies
    total = np.zeros((lines.size, len(CHANNELS)))
    for known, power in zip(fit.views, fit.power, strict=True):
        own = known.windows.frequencies
        total += np.column_stack([np.interp(lines, own, power[:, axis]) for axis in range(len(CHANNELS))])
    return np.asarray(total / len(fit.views))


def _predictive(
    view: View, power: Array, own_power: Array, rows: Array, slopes: Array, step: Array, information: Array
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
    spread = SHARE * rows.shape[0] * float(np.sum(lines[:, None] * np.log(own_power) * view.axes))
    score = -spread - 0.5 * float(scaled @ scaled) + 0.5 * float(right @ solve(gained, right)) - 0.5 * (after - before)
    return score, amplitudes(change, weights(view.windows, power))


def probabilities(scores: Sequence[Array], seed: int = 0) -> Array:
    """Probability of each explanation from its scores (G,) of the same groups: pseudo-BMA+."""
    table = np.array(scores)
    count = table.shape[1]
    draws = np.random.default_rng(seed).dirichlet(np.ones(count), _DRAWS) * count
    totals = draws @ table.T
    totals -= totals.max(axis=1, keepdims=True)
    share = np.exp(totals)
    share /= share.sum(axis=1, keepdims=True)
    mean: Array = share.mean(axis=0)
    return mean
