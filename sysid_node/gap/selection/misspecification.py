"""Tests of an effect's equation: whether what an effect leaves depends on what the effect does.

The right effect has one size: the same to either side, for small and for large movements, early and late. So its
contribution to each channel, rectified, weighted by its own size and weighted by time, must explain nothing of the
remainder. These are the added regressors of Ramsey (1969), J. R. Stat. Soc. B 31(2), and a score test for parameters
that are not constant (Nyblom (1989), J. Am. Stat. Assoc. 84). A gyro that saturates is not a gyro with a scale error,
although a scale error explains most of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, FlightFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.spectral_weights import real_rows
from sysid_node.gap.instruments.moment_equations import weights_without_mean
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


def misspecification_of(fit: CandidateFit, candidate: Candidate) -> Misspecification:
    """The tests of one of a fit's candidates over its flights; all unknowns of the fit are free to move."""
    contributed, explained, added = (np.zeros(len(CHANNELS)) for _ in range(3))
    for flight in fit.flights:
        contribution = _contribution(flight.model, flight.point, candidate)
        for axis in np.flatnonzero(flight.model.axes & (contribution.std(axis=0) > 0.0)):
            power, sum_of_squares, count = _tested(fit, flight, contribution[:, axis], int(axis))
            contributed[axis] += power
            explained[axis] += sum_of_squares
            added[axis] += count
    beyond = explained - added
    deviations = beyond / np.sqrt(2.0 * np.maximum(added, 1.0))
    return Misspecification(contributed, np.maximum(beyond, 0.0), deviations)


def _tested(fit: CandidateFit, flight: FlightFit, contribution: Array, axis: int) -> tuple[float, float, int]:
    """Of one flight and channel: the contribution's power, what added regressors explain, and how many these are.

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
        return 0.0, 0.0, 0
    unknowns = slopes.reshape(*residual.shape, slopes.shape[2])[:, :, axis] * kept[:, None]
    J = unknowns.reshape(-1, slopes.shape[2])
    squares = _explained(np.column_stack(added), (residual[:, :, axis] * kept).ravel(), J, fit.information)
    return float(whole @ whole), squares, len(added)


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


def _explained(added: Array, remainder: Array, slopes: Array, information: Array) -> float:
    """Sum of squares by which a remainder (R,) falls with added regressors (R, m), the unknowns moving along.

    The remainder is that of a fit, so that its gradient in the unknowns is zero.
    """
    crossed = added.T @ slopes
    free = added.T @ added - crossed @ np.linalg.solve(information, crossed.T)
    gradient = added.T @ remainder
    ridge = _RIDGE * np.trace(added.T @ added) / added.shape[1] * np.eye(added.shape[1])
    return float(gradient @ np.linalg.solve(free + ridge, gradient))
