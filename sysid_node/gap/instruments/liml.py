"""The final sizes in moving air, which neither gusts nor chance bias.

Least squares passes part of the gusts off as the aircraft's doing. The instruments of ``structure`` owe nothing to
gusts, but m of n directions hold m / n of everything, gusts included: two-stage least squares errs toward least squares
by so much (Bekker (1994), Econometrica 62(3)). A k-class estimator takes it off again (Theil (1958), Economic Forecasts
and Policy; Nagar (1959), Econometrica 27(4)): by channel the k of limited information maximum likelihood (Anderson &
Rubin (1949), Ann. Math. Stat. 20(1)), and at most chance's, for where the model lacks something the likelihood's k is
the lack.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.fit import CandidateFit, linearised, stepped
from sysid_node.gap.estimation.nuisances import is_gusty
from sysid_node.gap.instruments.overidentification import MomentEquations, limited_step, moment_equations, prior_terms
from sysid_node.gap.residuals.windowed_spectra import INDEPENDENT_SHARE

#: Rounds of k and the step by turns; a tenth changes nothing that matters.
_ROUNDS = 10


def liml_estimate(fit: CandidateFit) -> CandidateFit:
    """The fit as the instruments have it where the air moves; in still air least squares has no bias, and errs less."""
    return k_class_step(k_class_step(fit)) if any(is_gusty(model) for model in fit.models) else fit


def k_class_step(fit: CandidateFit) -> CandidateFit:
    """The fit with its unknowns as the instruments have them; its information is the inverse of their covariance.

    One Gauss-Newton step from where the fit stands, and everything linearised there.
    """
    seen = moment_equations(fit, fit.power)
    channels = _channels(seen)
    step, corrected = _solved(fit, seen, channels)
    scores = seen.information.copy()  # their covariance: Bekker's, without third and fourth moments
    for channel in channels:
        beyond, excess = channel.scatter(step), channel.excess(step)
        scores += (beyond - 1.0) * channel.coherent[:-1, :-1] + beyond * excess**2 * channel.rest[:-1, :-1]
    information = corrected.information @ np.linalg.solve(scores, corrected.information)
    return replace(linearised(stepped(fit, step)), information=0.5 * (information + information.T))


def influence(fit: CandidateFit) -> list[Array]:
    """By flight (W, unknowns): how far each window alone moves the unknowns of a fit as ``unbiased`` leaves it."""
    if not any(is_gusty(model) for model in fit.models):
        return [np.einsum("wru,wr->wu", J, r) @ fit.covariance for J, r in zip(fit.slopes, fit.rows, strict=True)]
    known, information = moment_weights(fit)
    scores = (np.einsum("wru,wr->wu", K, r) for K, r in zip(known, fit.rows, strict=True))
    return [np.linalg.solve(information, score.T).T for score in scores]


def moment_weights(fit: CandidateFit) -> tuple[Sequence[Array], Array]:
    """What multiplies the remainder in the equations that a fit as ``unbiased`` leaves it solves, and their matrix.

    By flight (W, R, unknowns): the slopes in still air; in moving air, what of them the instruments see, less chance's
    share, and the slopes of the means.
    """
    if not any(is_gusty(model) for model in fit.models):
        assert fit.information is not None
        return fit.slopes, fit.information
    seen = moment_equations(fit, fit.power)
    channels = _channels(seen)
    step, corrected = _solved(fit, seen, channels)
    found, order = [], iter(channels)
    for basis, J, slopes in zip(seen.basis, seen.slopes, fit.slopes, strict=True):
        known = np.zeros_like(J)
        known[:, 0] = slopes.reshape(J.shape)[:, 0]
        for axis, directions in basis.items():
            own, excess = J[:, :, axis].reshape(-1, J.shape[3]), next(order).excess(step)
            coherent = (1.0 + excess) * (directions @ (directions.T @ own)) - excess * own
            known[:, 1:, axis] = coherent.reshape(J[:, :, axis].shape)[:, 1:]
        found.append(known.reshape(slopes.shape))
    return found, corrected.information


def _solved(fit: CandidateFit, seen: MomentEquations, channels: Sequence[_Channel]) -> tuple[Array, MomentEquations]:
    """The step (unknowns,), and the equations that it solves."""
    precision, _ = prior_terms(fit)
    step, corrected = limited_step(seen, fit), seen
    for _ in range(_ROUNDS):
        corrected = _without_chance(seen, channels, step, precision)
        step = limited_step(corrected, fit)
    return step, corrected


@dataclass(frozen=True)
class _Channel:
    """Sums of squares and products (unknowns + 1, unknowns + 1) of one channel's slopes and, last, its remainder."""

    coherent: Array  # with the instruments
    rest: Array
    directions: int  # that the instruments span
    others: float  # directions of the rest that are independent

    def excess(self, step: Array) -> float:
        """k - 1, a step (unknowns,) on: what is coherent by chance, as a share of the rest."""
        inside, outside = self._left(step)
        return min(inside / max(outside, 1e-300), self.directions / self.others)

    def scatter(self, step: Array) -> float:
        """Times that the remainder is coherent beyond chance: what the model lacks counts as noise."""
        return max(1.0, self._left(step)[0] / self.directions)

    def _left(self, step: Array) -> tuple[float, float]:
        direction = np.append(-step, 1.0)
        return float(direction @ self.coherent @ direction), float(direction @ self.rest @ direction)


def _channels(seen: MomentEquations) -> list[_Channel]:
    """Those on which there are instruments, flight by flight."""
    found = []
    for basis, rows, slopes in zip(seen.basis, seen.rows, seen.slopes, strict=True):
        table = np.concatenate([slopes, rows[..., None]], axis=3)
        for axis, directions in basis.items():
            own, count = table[:, :, axis].reshape(-1, table.shape[3]), directions.shape[1]
            along = directions.T @ own
            coherent = along.T @ along
            others = max(INDEPENDENT_SHARE * np.count_nonzero(own.any(axis=1)) - count, 1.0)
            found.append(_Channel(coherent, own.T @ own - coherent, count, others))
    return found


def _without_chance(
    seen: MomentEquations, channels: Sequence[_Channel], step: Array, precision: Array
) -> MomentEquations:
    """The equations without what the instruments see by chance; never less is known than before the flight."""
    information, right = seen.information.copy(), seen.right.copy()
    for channel in channels:
        excess = channel.excess(step)
        information -= excess * channel.rest[:-1, :-1]
        right -= excess * channel.rest[:-1, -1]
    return replace(seen, information=at_least_prior(information, precision), right=right)


def at_least_prior(information: Array, precision: Array) -> Array:
    """Information (unknowns, unknowns) that is in no direction less than that of the priors (unknowns,)."""
    unit = precision**-0.5
    scaled = information * np.outer(unit, unit)
    sizes, directions = np.linalg.eigh(0.5 * (scaled + scaled.T))
    return np.asarray((directions * np.maximum(sizes, 1.0)) @ directions.T / np.outer(unit, unit))
