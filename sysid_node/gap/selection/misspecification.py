"""Whether what an effect leaves owes anything to what the effect does: the right one leaves nothing of the kind.

The right effect has one size: the same to either side, for small and for large movements, early and late. So its
contribution to each channel, rectified, weighted by its own size and by time, must foretell nothing of the remainder.
These are Ramsey's (1969) added regressors (Journal of the Royal Statistical Society B 31(2)), and a score test for
parameters that are not constant (Nyblom (1989), Journal of the American Statistical Association 84). A gyro that
saturates is no gyro that reads low by a share, however well a share accounts for the most of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.spectral_weights import real_rows
from sysid_node.gap.instruments.moment_equations import weights_without_mean
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS

#: Penalty on the added regressors, as a share of their power: they may be nearly alike.
_RIDGE = 1e-6


@dataclass(frozen=True)
class Misspecification:
    """By channel (12,), powers in noise levels: of what an effect does, and of what of the remainder goes with it."""

    contributed: Array  # of what the effect does
    explained: Array  # of what of the remainder depends on it, beyond chance
    deviations: Array  # standard deviations by which that exceeds chance


def misspecification_of(fit: CandidateFit, candidate: Candidate) -> Misspecification:
    """Of one of a fit's candidates, over its flights, all its unknowns left free to move."""
    done, found, size = np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS))
    assert fit.information is not None
    for flight in fit.flights:
        model, slopes = flight.model, flight.slopes
        weight = weights_without_mean(model, flight.power)
        parts = flight.rows.reshape(flight.rows.shape[0], -1, len(CHANNELS))
        unknowns = slopes.reshape(*parts.shape, slopes.shape[2])
        contribution = _contribution(model, flight.point, candidate)
        for axis in np.flatnonzero(model.axes & (contribution.std(axis=0) > 0.0)):
            own, kept = contribution[:, axis], (weight[:, axis] > 0.0)
            whole, *added = (_rows(model, x, weight[:, axis]) for x in (own, *_modulated(own, model.record.time)))
            if whole @ whole < THRESHOLDS.calibration.least_power:
                continue
            J = (unknowns[:, :, axis] * kept[:, None]).reshape(-1, slopes.shape[2])
            done[axis] += float(whole @ whole)
            found[axis] += _explained(np.column_stack(added), (parts[:, :, axis] * kept).ravel(), J, fit.information)
            size[axis] += len(added)
    beyond = found - size
    return Misspecification(done, np.maximum(beyond, 0.0), beyond / np.sqrt(2.0 * np.maximum(size, 1.0)))


def _contribution(model: ResidualModel, point: Array, candidate: Candidate) -> Array:
    """What the candidate adds to the channels (N, 12)."""
    without, entries = point.copy(), list(candidate.entries)
    without[entries] = model.simulator.neutral()[entries]
    return model.predicted_series(point) - model.predicted_series(without)


def _modulated(own: Array, time: Array) -> list[Array]:
    """A contribution (N,) rectified, weighted by its own size, and by time."""
    swing, late = own - own.mean(), time - time.mean()
    return [np.abs(swing), own * np.abs(own) / own.std(), own * late / late.std()]


def _rows(model: ResidualModel, series: Array, weight: Array) -> Array:
    """A series (N,) as weighted real rows (R,) of one channel."""
    return real_rows(model.windows.transform(series[:, None]), weight[:, None]).ravel()


def _explained(added: Array, remainder: Array, slopes: Array, information: Array) -> float:
    """Sum of squares by which a remainder (R,) falls with added regressors (R, m), the unknowns moving along.

    The remainder is one of a fit, at rest in its unknowns.
    """
    crossed = added.T @ slopes
    free = added.T @ added - crossed @ np.linalg.solve(information, crossed.T)
    pull = added.T @ remainder
    ridge = _RIDGE * np.trace(added.T @ added) / added.shape[1] * np.eye(added.shape[1])
    return float(pull @ np.linalg.solve(free + ridge, pull))
