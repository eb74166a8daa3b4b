"""Least squares on the information matrices: values, covariances, and what they rest on.

All coefficients with the same regressors share one factorisation; the groups stand as blocks on the diagonal of one
matrix, so that one call solves for all six coefficients.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv
from scipy.special import stdtrit

from sysid_node.online.information import BANDS, Information
from sysid_node.online.signals import Layout

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Weight of the mean density, in degrees of freedom, when the residual's density in one band is estimated.
BAND_PRIOR = 20.0
#: Energy under which a regressor has not moved at all.
TINY = 1e-18


@dataclass(frozen=True)
class Plan:
    """Which entries of the W x W Gram matrix make the normal equations. P unknowns (blocks), C coefficients."""

    coefficients: tuple[str, ...]
    regressors: tuple[str, ...]  # of each unknown
    group: Index  # (P,) block of each unknown
    block: Index  # (C,) block of each coefficient
    columns: Index  # (P,) column of each unknown's regressor
    outputs: Index  # (C,) column of each coefficient
    normal: Index  # (P, P) flat indices
    same: Array  # (P, P) 1 where two unknowns belong to one block
    right: Index  # (P, C) flat indices
    mine: Array  # (P, C) 1 where the unknown belongs to the coefficient
    square: Index  # (C,) flat indices of the outputs' own squares

    def unknowns(self, coefficient: int) -> Index:
        """Indices of a coefficient's unknowns."""
        return np.flatnonzero(self.group == self.block[coefficient])


def plan(structure: dict[str, tuple[str, ...]], layout: Layout) -> Plan:
    """Normal equations for a model structure, e.g. ``{"Cm": ("0", "alpha", "q", "de")}``; offsets come after."""
    slopes = {c: tuple(r for r in rs if r != "0") for c, rs in structure.items()}
    blocks = list(dict.fromkeys(slopes.values()))
    regressors = tuple(r for block in blocks for r in block)
    group = np.array([i for i, block in enumerate(blocks) for _ in block], dtype=np.intp)
    block = np.array([blocks.index(rs) for rs in slopes.values()], dtype=np.intp)
    columns = np.array([layout.column(r) for r in regressors], dtype=np.intp)
    outputs = np.array([layout.column(c) for c in slopes], dtype=np.intp)
    W = layout.width
    return Plan(
        coefficients=tuple(slopes),
        regressors=regressors,
        group=group,
        block=block,
        columns=columns,
        outputs=outputs,
        normal=columns[:, None] * W + columns,
        same=(group[:, None] == group).astype(float),
        right=columns[:, None] * W + outputs,
        mine=(group[:, None] == block).astype(float),
        square=outputs * W + outputs,
    )


@dataclass
class Solution:
    """Least-squares solution of all coefficients. ``usable`` is False where the normal matrix is singular."""

    theta: Array  # (P, C), zero where an unknown does not belong
    inverse: Array  # (P, P) of the normal matrix
    residual: Array  # (C,) sum of squares
    usable: bool


def solve(plan: Plan, gram: Array, bias: Array | None = None) -> Solution:
    """Solve the normal equations of a summed Gram matrix (W, W), less what noise adds to it on the average, ``bias``."""
    P = plan.columns.size
    normal = gram.take(plan.normal) * plan.same
    right = gram.take(plan.right) * plan.mine
    squares = gram.take(plan.square)
    if bias is None:
        matrix, sides = normal, right
    else:
        matrix = normal - bias.take(plan.normal) * plan.same
        sides = right - bias.take(plan.right) * plan.mine
    scale = matrix.diagonal()
    if not (scale > TINY).all():
        return Solution(np.zeros_like(right), np.zeros((P, P)), squares, False)
    scale = scale**-0.5
    _, solved, fault = dposv(matrix * scale[:, None] * scale, np.hstack([np.diag(scale), sides * scale[:, None]]))
    if fault:
        return Solution(np.zeros_like(right), np.zeros((P, P)), squares, False)
    solved *= scale[:, None]
    theta = solved[:, P:]
    # |y - A theta|^2, with the noise in it
    residual = squares + ((normal @ theta - 2.0 * right) * theta).sum(axis=0)
    return Solution(theta, solved[:, :P], np.maximum(residual, 0.0), True)


@dataclass
class Uncertainty:
    """What the residuals of all coefficients say of the estimates' covariance."""

    covariance: Array  # (C, P, P) of the unknowns, zero where they do not belong
    density: Array  # (C,) of the residual over the whole band
    bands: Array  # (C, B) of the residual in each band
    freedom: Array  # (C,) degrees of freedom


def uncertainty(plan: Plan, solution: Solution, info: Information) -> Uncertainty:
    """Sandwich covariance with the residual's spectral density estimated in each band."""
    C, P = len(plan.coefficients), plan.columns.size
    result = Uncertainty(np.zeros((C, P, P)), np.zeros(C), np.zeros((C, BANDS)), np.zeros(C))
    if not solution.usable:
        return result
    for c in range(C):
        mine = plan.unknowns(c)
        columns = plan.columns[mine]
        v = np.zeros(info.grams.shape[1])
        v[plan.outputs[c]] = 1.0
        v[columns] = -solution.theta[mine, c]
        squares = np.maximum(info.grams @ v @ v, 0.0)
        scores = info.scores[:, columns[:, None], columns]
        inverse = solution.inverse[np.ix_(mine, mine)]
        expected = np.maximum(info.traces - np.einsum("ij,bji->b", inverse, scores), 0.05 * info.traces + 1e-300)
        mean = squares.sum() / expected.sum()
        freedom = float(expected.sum()) ** 2 / info.trace_square if info.trace_square > 0.0 else 0.0
        share = freedom * expected / expected.sum()
        bands = (share * squares / expected + BAND_PRIOR * mean) / (share + BAND_PRIOR)
        middle = np.einsum("b,bij->ij", bands, scores)
        result.covariance[np.ix_([c], mine, mine)] = inverse @ middle @ inverse
        result.density[c], result.bands[c], result.freedom[c] = mean, bands, freedom
    return result


def student_95(freedom: Array) -> Array:
    """Two-sided 95 % quantile of Student's t."""
    return np.asarray(stdtrit(np.maximum(freedom, 1.0), 0.975))


def collinear_with(plan: Plan, solution: Solution, unknown: int) -> str:
    """The regressor whose estimate is most correlated with this one's."""
    spread = np.sqrt(solution.inverse.diagonal())
    correlation = np.abs(solution.inverse[unknown]) / (spread * spread[unknown]) * plan.same[unknown]
    correlation[unknown] = -math.inf
    return plan.regressors[int(np.argmax(correlation))]
