"""Tests of an effect's equation: whether what an effect leaves depends on what the effect does.

The right effect has one size: the same to either side, for small and for large movements, early and late. So its
contribution to each channel, rectified, weighted by its own size and weighted by time, must explain nothing of the
remainder. These are the added regressors of Ramsey (1969), J. R. Stat. Soc. B 31(2), and a score test for parameters
that are not constant (Nyblom (1989), J. Am. Stat. Assoc. 84). A gyro that saturates is not a gyro with a scale error,
although a scale error explains most of it.

In moving air the remainder is weather, which comes in bursts, and an autopilot moves the surfaces most where the air
moves most. A remainder and a contribution that are large together are correlated by chance, more than a remainder of
constant power is. What chance explains is therefore computed there from the power of each window, as the added
regressors leave it (heteroskedasticity by groups: White (1980), Econometrica 48(4)).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, FlightFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.spectral_weights import real_rows
from sysid_node.gap.instruments.moment_equations import weights_without_mean
from sysid_node.gap.residuals.air_motion import is_gusty
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS

#: Ridge on the added regressors, as a share of their power, because they may be nearly collinear.
_RIDGE = 1e-6


@dataclass(frozen=True)
class Misspecification:
    """The tests of one effect, by channel (12,); powers are in noise levels."""

    contributed: Array  # of what the effect does
    explained: Array  # of what of the remainder depends on it, beyond chance
    deviations: Array  # standard deviations by which that exceeds chance


class Explained(NamedTuple):
    """What added regressors explain of a remainder: the sum of squares, and its mean and variance by chance."""

    squares: float
    mean: float
    variance: float


def misspecification_of(fit: CandidateFit, candidate: Candidate) -> Misspecification:
    """The tests of one of a fit's candidates over its flights; all unknowns of the fit are free to move."""
    contributed, explained, mean, variance = (np.zeros(len(CHANNELS)) for _ in range(4))
    for flight in fit.flights:
        contribution = _contribution(flight.model, flight.point, candidate)
        for axis in np.flatnonzero(flight.model.axes & (contribution.std(axis=0) > 0.0)):
            power, found = _tested(fit, flight, contribution[:, axis], int(axis))
            contributed[axis] += power
            explained[axis] += found.squares
            mean[axis] += found.mean
            variance[axis] += found.variance
    beyond = explained - mean
    deviations = beyond / np.sqrt(np.maximum(variance, 2.0))
    return Misspecification(contributed, np.maximum(beyond, 0.0), deviations)


def _tested(fit: CandidateFit, flight: FlightFit, contribution: Array, axis: int) -> tuple[float, Explained]:
    """Of one flight and channel: the contribution's power, and what added regressors explain.

    All zero where the contribution (N,) is too small to be tested.
    """
    assert fit.information is not None
    model, slopes = flight.model, flight.slopes
    weight = weights_without_mean(model, flight.power)
    kept = weight[:, axis] > 0.0
    residual = flight.rows.reshape(flight.rows.shape[0], -1, len(CHANNELS))
    series = (contribution, *_added_regressors(contribution, model.record.time))
    whole, *added = (_rows(model, each, weight[:, axis]) for each in series)
    if whole @ whole < THRESHOLDS.calibration.least_power:
        return 0.0, Explained(0.0, 0.0, 0.0)
    unknowns = slopes.reshape(*residual.shape, slopes.shape[2])[:, :, axis] * kept[:, None]
    J = unknowns.reshape(-1, slopes.shape[2])
    remainder = (residual[:, :, axis] * kept).ravel()
    windows = np.arange(remainder.size) * model.windows.count // remainder.size if is_gusty(model) else None
    return float(whole @ whole), explained_by(np.column_stack(added), remainder, J, fit.information, windows)


def _contribution(model: ResidualModel, point: Array, candidate: Candidate) -> Array:
    """What the candidate adds to the channels (N, 12) at parameters (P,)."""
    without, entries = point.copy(), list(candidate.entries)
    without[entries] = model.simulator.neutral()[entries]
    return model.predicted_series(point) - model.predicted_series(without)


def _added_regressors(contribution: Array, time: Array) -> list[Array]:
    """A contribution (N,) rectified, weighted by its own size, and by time."""
    swing, late = contribution - contribution.mean(), time - time.mean()
    by_size = contribution * np.abs(contribution) / contribution.std()
    return [np.abs(swing), by_size, contribution * late / late.std()]


def _rows(model: ResidualModel, series: Array, weight: Array) -> Array:
    """A series (N,) as weighted real rows (R,) of one channel."""
    return real_rows(model.windows.transform(series[:, None]), weight[:, None]).ravel()


def explained_by(
    added: Array, remainder: Array, slopes: Array, information: Array, windows: NDArray[np.intp] | None = None
) -> Explained:
    """What added regressors (R, m) explain of a remainder (R,), the unknowns moving along.

    The remainder is that of a fit, so that its gradient in the unknowns is zero. Chance is that of a remainder whose
    power is one throughout; with ``windows`` (R,), numbers of windows, at least that of one whose power changes from
    window to window as that of the rest does which the added regressors leave.
    """
    crossed = added.T @ slopes
    shares = np.linalg.solve(information, crossed.T)
    free = added.T @ added - crossed @ shares
    ridge = _RIDGE * np.trace(added.T @ added) / added.shape[1] * np.eye(added.shape[1])
    inverse = np.linalg.inv(free + ridge)
    gradient, count = added.T @ remainder, float(added.shape[1])
    squares, mean, variance = float(gradient @ inverse @ gradient), count, 2.0 * count
    if windows is not None:
        regressors = added - slopes @ shares
        left = remainder - regressors @ (inverse @ gradient)
        power = np.bincount(windows, left**2) / np.maximum(np.bincount(windows, left != 0.0), 1)
        level = power / max(float(np.mean(left[left != 0.0] ** 2)), 1e-300)
        scatter = inverse @ (regressors.T @ (regressors * level[windows][:, None]))
        mean, variance = max(mean, float(np.trace(scatter))), max(variance, 2.0 * float(np.trace(scatter @ scatter)))
    return Explained(squares, mean, variance)
