"""The covariance of all derivatives at one time: by noise and gusts, and by the tolerances of what is taken as known.

Of noise, the residuals of two coefficients are taken as independent, as the estimator takes them: derivatives of
different coefficients then share no statistical error. They do share systematic errors. An airspeed that reads two
percent high, say, moves all of them together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.estimates.current_solution import CurrentSolution, current_solution
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.regression.mixed_estimation import gained
from sysid_node.online.state import EstimatorState, SegmentSolution

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EstimateCovariance:
    """The covariance of D derivatives: its parts are ``statistical`` and ``systematic`` (D, D).

    The diagonals are the squares of the estimates' statistical and systematic errors.
    """

    names: tuple[str, ...]
    statistical: Array
    systematic: Array

    @property
    def total(self) -> Array:
        """(D, D) of all errors; the diagonal holds the squared standard errors."""
        return np.asarray(self.statistical + self.systematic)

    def correlation(self) -> tuple[tuple[str, ...], Array]:
        """The derivatives whose errors are finite, and the correlation of these errors."""
        total = self.total
        variances = total.diagonal()
        known = np.flatnonzero(np.isfinite(variances) & (variances > 0.0))
        deviations = np.sqrt(variances[known])
        matrix = total[np.ix_(known, known)] / np.outer(deviations, deviations)
        return tuple(self.names[i] for i in known.tolist()), np.clip(matrix, -1.0, 1.0)


def estimate_covariance(state: EstimatorState) -> EstimateCovariance | None:
    """The covariance of the estimates with all samples so far; None before there are any.

    Derivatives whose equation cannot be formed are left out.
    """
    current, latest, table = current_solution(state), state.latest, state.model.table
    if current is None or latest is None:
        return None
    deviation = np.sqrt(current.variances)
    statistical = _statistical_correlation(state, latest) * deviation[:, None] * deviation
    return EstimateCovariance(table.names, statistical, _systematic(state, latest, current))


def _statistical_correlation(state: EstimatorState, latest: SegmentSolution) -> Array:
    """(D, D) correlation of the statistical errors, zero between coefficients.

    That of slopes is their covariance's. An offset is C_0 = (y - sum theta_j x_j) / k at zero frequency, so that its
    error follows from the slopes' errors and from the noise of the integrals.
    """
    equations, table = state.equations, state.model.table
    C, P = len(equations.structure.coefficients), equations.columns.size
    weight = latest.total.integrals[OFFSET]
    x = latest.total.integrals[equations.columns] / (weight if weight else 1.0)
    covariance = np.zeros((C, P + 1, P + 1))
    slopes = latest.uncertainty.covariance
    if state.model.settings.use_prior:
        slopes = _with_prior(state, slopes)
    covariance[:, :P, :P] = slopes
    covariance[:, P, :P] = covariance[:, :P, P] = -(slopes @ x)
    noise = latest.later.trim_noise / (weight * weight) if weight else latest.later.trim_noise
    covariance[:, P, P] = slopes @ x @ x + noise
    deviation = np.sqrt(np.maximum(covariance.diagonal(axis1=1, axis2=2), 0.0))
    deviation[deviation == 0.0] = np.inf
    covariance /= deviation[:, :, None] * deviation[:, None, :]
    c, place = table.coefficient, table.place - table.coefficient * (P + 1)
    found = covariance[c[:, None], place[:, None], place]
    found[c[:, None] != c] = 0.0
    np.fill_diagonal(found, 1.0)
    return np.asarray(found)


def _with_prior(state: EstimatorState, covariance: Array) -> Array:
    """(C, P, P) the covariance after the aircraft file's values are counted in: see ``mixed_estimation``."""
    _, precisions = state.model.prior
    gain = state.equations.structure.unit + covariance * precisions.T[:, None]
    return gained(gain, covariance)


def _systematic(state: EstimatorState, latest: SegmentSolution, current: CurrentSolution) -> Array:
    """(D, D) J N J': what the imperfections, as the flight knows them, do to the derivatives."""
    if latest.systematic is None:
        return np.zeros((current.values.size, current.values.size))
    considered = latest.systematic.considered
    jacobian = considered.jacobian.reshape(considered.jacobian.shape[0], -1)[:, state.model.table.place]
    return np.asarray(jacobian.T @ considered.covariance @ jacobian)
