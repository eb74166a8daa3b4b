"""The solution with all samples so far: every derivative and its variance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency import fourier_transform
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.regression import least_squares
from sysid_node.online.regression.information import edges, products
from sysid_node.online.regression.least_squares import Solution
from sysid_node.online.regression.mixed_estimation import gained, weighed
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.state import EstimatorState, SegmentSolution, current_lines

Array = NDArray[np.float64]


@dataclass
class CurrentSolution:
    """What is solved for with all samples so far: D derivatives, P unknowns, W signals."""

    time: float  # s, of the last sample
    values: Array  # (D,)
    variances: Array  # (D,) squared standard errors, statistical
    solution: Solution
    gram: Array  # (W, W)
    size: Array  # (P,) absolute values of the inverse's diagonal


def current_solution(state: EstimatorState) -> CurrentSolution | None:
    """Values and variances of all derivatives with every sample so far; None before the first half second of data."""
    latest, equations = state.latest, state.equations
    if latest is None:
        return None
    time, impulses = state.transform.last, None
    impulse = fourier_transform.impulse(state.model.spectrum.omega, time)
    if state.controls.servos:
        impulses = edges(state.segment.start_impulse, impulse)
    lines = current_lines(state, impulse)
    integrals = latest.finished.integrals + lines[-1]
    gram = products(lines, state.controls.line_model, impulses)
    gram += latest.finished.gram
    growth, noise = growth_since(latest, time), latest.later.compensation
    solution = least_squares.solve(equations, gram, None if noise is None else noise * growth)
    size = np.abs(solution.inverse.diagonal())
    slopes = solution.theta.T
    variances = slope_variances(latest, solution.residual, size, growth)
    if state.model.settings.use_prior:
        slopes, variances = _with_prior(state, latest, slopes, variances)
    C, P = slopes.shape
    numbers = np.empty((2, C, P + 1))  # values and variances of the slopes and, behind them, of the offsets
    numbers[0, :, :P], numbers[1, :, :P] = slopes, variances
    numbers[0, :, P], numbers[1, :, P] = _offsets(equations, latest, integrals, slopes)
    if latest.systematic is not None:
        numbers[0] += latest.systematic.correction
    values, squares = numbers.reshape(2, C * (P + 1)).take(state.model.table.place, axis=-1)
    return CurrentSolution(time, values, np.maximum(squares, 0.0), solution, gram, size)


def slope_variances(latest: SegmentSolution, residual: Array, size: Array, growth: float) -> Array:
    """(C, P) squared standard errors of the slopes, before the aircraft file's values are counted in.

    ``residual`` (C,) and ``size`` (P,): of the present solution; ``growth``: see ``growth_since``.
    """
    variances: Array = residual[:, None].dot(size[None] / growth)
    variances *= latest.later.factors
    return variances


def growth_since(latest: SegmentSolution, time: float) -> float:
    """How many times as much time is counted at ``time`` (s) as at the last renewal.

    The noise's part in the equations has grown by so much since, and the variances have shrunk by it.
    """
    energy = latest.total.energy
    return (energy + (time - latest.time)) / max(energy, 1e-9)


def _with_prior(state: EstimatorState, latest: SegmentSolution, slopes: Array, variances: Array) -> tuple[Array, Array]:
    """(C, P) the ``slopes`` combined with the aircraft file's derivatives, and (C, P) their statistical variances.

    The corrected slopes are combined, with the sum K of their statistical and systematic covariances. The systematic
    variance is published as it is without the prior. The statistical variance is therefore the larger of two: the
    posterior variance less the systematic one, and what the weighting leaves of the statistical ``variances`` (C, P).
    """
    structure, (expected, precision) = state.equations.structure, state.model.prior
    P, found = slopes.shape[1], latest.systematic
    correction, systematic = np.zeros_like(slopes), np.zeros((*slopes.shape, P))
    if found is not None:
        jacobian = found.considered.jacobian[:, :, :P]
        correction = found.correction[:, :P]
        systematic = np.einsum("ncp,nm,mcq->cpq", jacobian, found.considered.covariance, jacobian)
    statistical = _with_diagonal(latest.uncertainty.covariance, variances)
    K = statistical + systematic
    values, posterior = weighed(structure, (slopes + correction).T, K, expected, precision)
    gain = structure.unit + K * precision.T[:, None]
    remaining = gained(gain, gained(gain, statistical).swapaxes(1, 2))
    both = (matrix.diagonal(axis1=1, axis2=2) for matrix in (posterior - systematic, remaining))
    return values.T - correction, np.maximum(*both)


def _with_diagonal(covariance: Array, variances: Array) -> Array:
    """A covariance (C, P, P) with the same correlations and other ``variances`` (C, P)."""
    before = covariance.diagonal(axis1=1, axis2=2)
    scale = np.sqrt(np.divide(variances, before, out=np.zeros_like(variances), where=before > 0.0))
    return np.asarray(covariance * scale[:, :, None] * scale[:, None, :])


def _offsets(
    equations: NormalEquations, latest: SegmentSolution, integrals: Array, slopes: Array
) -> tuple[Array, Array]:
    """(C,) offsets and their variances, from the ``integrals`` (W,) of all signals.

    At zero frequency k C_0 = y - sum k C_j x_j, with the ``slopes`` (C, P).
    """
    P, C = equations.structure.belongs.shape
    weight, sums = integrals[OFFSET], integrals.take(equations.entries.sides)
    x, y = sums[:P, None], sums[P:]
    left = y - slopes.dot(x)[:, 0]
    # x' covariance x
    spread = latest.uncertainty.covariance.reshape(C * P, P).dot(x).reshape(C, P).dot(x)[:, 0]
    return left / weight, (spread + latest.later.trim_noise) / weight / weight
