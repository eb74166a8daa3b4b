"""Limited-information maximum likelihood: sizes in moving air that are biased neither by gusts nor by chance.

Least squares attributes part of the gusts to the aircraft. The instruments are uncorrelated with gusts, but m of n
directions hold m / n of everything, gusts included, by chance: two-stage least squares errs toward least squares by so
much (Bekker (1994), Econometrica 62(3)). A k-class estimator corrects this (Theil (1958), Economic Forecasts and
Policy; Nagar (1959), Econometrica 27(4)). By channel, k is that of limited-information maximum likelihood (Anderson &
Rubin (1949), Ann. Math. Stat. 20(1)), but at most what chance gives: where the model is deficient, the likelihood's k
measures the deficiency.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised, stepped
from sysid_node.gap.instruments.moment_equations import MomentEquations, limited_step, moment_equations, prior_terms
from sysid_node.gap.residuals.air_motion import is_gusty
from sysid_node.gap.residuals.windowed_spectra import INDEPENDENT_SHARE

#: Rounds in which k and the step are computed by turns; more change nothing that matters.
_ROUNDS = 10


def liml_estimate(fit: CandidateFit) -> CandidateFit:
    """The fit with its unknowns as the instruments have them where the air moves.

    In still air least squares is unbiased and has the smaller variance: the fit is returned as it is.
    """
    return k_class_step(k_class_step(fit)) if _in_moving_air(fit) else fit


def k_class_step(fit: CandidateFit) -> CandidateFit:
    """The fit after one Gauss-Newton step of the k-class estimator, linearised there.

    Its information is the inverse of the estimate's covariance (Bekker's, without third and fourth moments).
    """
    equations = moment_equations(fit, fit.powers)
    channels = channel_products(equations)
    step, corrected = _solved(fit, equations, channels)
    scores = equations.information.copy()
    for channel in channels:
        beyond, excess = channel.scatter(step), channel.excess(step)
        scores += (beyond - 1.0) * channel.coherent[:-1, :-1] + beyond * excess**2 * channel.rest[:-1, :-1]
    information = corrected.information @ np.linalg.solve(scores, corrected.information)
    return replace(linearised(stepped(fit, step)), information=0.5 * (information + information.T))


def influence(fit: CandidateFit) -> list[Array]:
    """Influence (W, unknowns) by flight: how far each window alone moves the unknowns of a ``liml_estimate``."""
    if not _in_moving_air(fit):
        return [np.einsum("wru,wr->wu", f.slopes, f.rows) @ fit.covariance for f in fit.flights]
    moments, information = moment_weights(fit)
    scores = (np.einsum("wru,wr->wu", K, f.rows) for K, f in zip(moments, fit.flights, strict=True))
    return [np.linalg.solve(information, score.T).T for score in scores]


def moment_weights(fit: CandidateFit) -> tuple[Sequence[Array], Array]:
    """What multiplies the residual in the equations that a ``liml_estimate`` solves, and the equations' matrix.

    By flight (W, R, unknowns): in still air the slopes; in moving air what the instruments see of them, less chance's
    share, and the slopes of the means.
    """
    if not _in_moving_air(fit):
        assert fit.information is not None
        return [flight.slopes for flight in fit.flights], fit.information
    equations = moment_equations(fit, fit.powers)
    channels = channel_products(equations)
    step, corrected = _solved(fit, equations, channels)
    found, order = [], iter(channels)
    for flight, moments in zip(fit.flights, equations.flights, strict=True):
        J = moments.slopes
        known = np.zeros_like(J)
        known[:, 0] = flight.slopes.reshape(J.shape)[:, 0]
        for axis, directions in moments.basis.items():
            slopes, excess = J[:, :, axis].reshape(-1, J.shape[3]), next(order).excess(step)
            coherent = (1.0 + excess) * (directions @ (directions.T @ slopes)) - excess * slopes
            known[:, 1:, axis] = coherent.reshape(J[:, :, axis].shape)[:, 1:]
        found.append(known.reshape(flight.slopes.shape))
    return found, corrected.information


def _in_moving_air(fit: CandidateFit) -> bool:
    return any(is_gusty(model) for model in fit.models)


def _solved(
    fit: CandidateFit, equations: MomentEquations, channels: Sequence[ChannelProducts]
) -> tuple[Array, MomentEquations]:
    """The step (unknowns,), and the corrected equations that it solves."""
    precision, _ = prior_terms(fit)
    step, corrected = limited_step(equations, fit), equations
    for _ in range(_ROUNDS):
        corrected = without_chance(equations, channels, step, precision)
        step = limited_step(corrected, fit)
    return step, corrected


@dataclass(frozen=True)
class ChannelProducts:
    """Sums of squares and products (unknowns + 1, unknowns + 1) of one channel's slopes and, last, its residual."""

    coherent: Array  # with the instruments
    rest: Array
    directions: int  # that the instruments span
    others: float  # number of the remaining directions that are independent

    def excess(self, step: Array) -> float:
        """k - 1 after a step (unknowns,): what is coherent by chance, as a share of the rest."""
        inside, outside = self._residual_power(step)
        return min(inside / max(outside, 1e-300), self.directions / self.others)

    def scatter(self, step: Array) -> float:
        """Factor by which the residual is coherent beyond chance: a deficiency of the model counts as noise."""
        return max(1.0, self._residual_power(step)[0] / self.directions)

    def _residual_power(self, step: Array) -> tuple[float, float]:
        direction = np.append(-step, 1.0)
        return float(direction @ self.coherent @ direction), float(direction @ self.rest @ direction)


def channel_products(equations: MomentEquations) -> list[ChannelProducts]:
    """The products of all channels that have instruments, flight by flight."""
    found = []
    for flight in equations.flights:
        table = np.concatenate([flight.slopes, flight.rows[..., None]], axis=3)
        for axis, directions in flight.basis.items():
            columns, count = table[:, :, axis].reshape(-1, table.shape[3]), directions.shape[1]
            along = directions.T @ columns
            coherent = along.T @ along
            others = max(INDEPENDENT_SHARE * np.count_nonzero(columns.any(axis=1)) - count, 1.0)
            found.append(ChannelProducts(coherent, columns.T @ columns - coherent, count, others))
    return found


def without_chance(
    equations: MomentEquations, channels: Sequence[ChannelProducts], step: Array, precision: Array
) -> MomentEquations:
    """The equations without what the instruments see by chance at a step (unknowns,).

    ``precision`` (unknowns,) of the priors: no less is known than before the flight.
    """
    information, right = equations.information.copy(), equations.right.copy()
    for channel in channels:
        excess = channel.excess(step)
        information -= excess * channel.rest[:-1, :-1]
        right -= excess * channel.rest[:-1, -1]
    return replace(equations, information=at_least_prior(information, precision), right=right)


def at_least_prior(information: Array, precision: Array) -> Array:
    """Information (unknowns, unknowns) that is in no direction less than that of the priors (unknowns,)."""
    unit = precision**-0.5
    scaled = information * np.outer(unit, unit)
    sizes, directions = np.linalg.eigh(0.5 * (scaled + scaled.T))
    return np.asarray((directions * np.maximum(sizes, 1.0)) @ directions.T / np.outer(unit, unit))
