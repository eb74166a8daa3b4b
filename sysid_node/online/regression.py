"""Least squares on the information matrices: values, covariances, and what they rest on.

All coefficients with the same regressors share one factorisation; the groups stand as blocks on the diagonal of one
matrix, so that one call solves for all six coefficients.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv, dposv
from scipy.special import stdtrit

from sysid_node.online.information import BANDS, Information
from sysid_node.online.signals import Layout

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Weight of the mean density, in degrees of freedom, when the residual's density in one band is estimated.
BAND_PRIOR = 8.0
#: F statistic of an instrument under which estimates that rest on it are not to be trusted.
STRONG = 15.0
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
    instruments: Index  # (P,) column of each unknown's instrument: its regressor, in least squares
    same: Array  # (P, P) 1 where two unknowns belong to one block
    mine: Array  # (P, C) 1 where the unknown belongs to the coefficient
    width: int  # W
    normal: Index = field(init=False)  # (P, P) flat indices of A'A
    right: Index = field(init=False)  # (P, C) of A'y
    cross: Index = field(init=False)  # (P, P) of Z'A
    sides: Index = field(init=False)  # (P, C) of Z'y
    square: Index = field(init=False)  # (C,) of y'y
    unit: Array = field(init=False)  # (P, P)
    least_squares: bool = field(init=False)  # whether every regressor is its own instrument

    def __post_init__(self) -> None:
        def entries(rows: Index, columns: Index) -> Index:
            return rows[:, None] * self.width + columns

        object.__setattr__(self, "normal", entries(self.columns, self.columns))
        object.__setattr__(self, "right", entries(self.columns, self.outputs))
        object.__setattr__(self, "cross", entries(self.instruments, self.columns))
        object.__setattr__(self, "sides", entries(self.instruments, self.outputs))
        object.__setattr__(self, "square", self.outputs * (self.width + 1))
        object.__setattr__(self, "unit", np.eye(self.columns.size))
        object.__setattr__(self, "least_squares", bool((self.columns == self.instruments).all()))

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
    return Plan(
        coefficients=tuple(slopes),
        regressors=regressors,
        group=group,
        block=block,
        columns=np.array([layout.column(r) for r in regressors], dtype=np.intp),
        outputs=np.array([layout.column(c) for c in slopes], dtype=np.intp),
        instruments=np.array([layout.instrument(r) for r in regressors], dtype=np.intp),
        same=(group[:, None] == group).astype(float),
        mine=(group[:, None] == block).astype(float),
        width=layout.width,
    )


def trusting(full: Plan, strength: Array) -> Plan:
    """The plan with least squares in the blocks of which an instrument is weak: better biased a little than lost."""
    weak = [block for block in range(int(full.group.max()) + 1) if (strength[full.group == block] < STRONG).any()]
    if not weak:
        return full
    return replace(full, instruments=np.where(np.isin(full.group, weak), full.columns, full.instruments))


@dataclass
class Solution:
    """Solution of all coefficients' normal equations. ``usable`` is False where they are singular."""

    theta: Array  # (P, C), zero where an unknown does not belong
    inverse: Array  # (P, P) of Z'A (of A'A in least squares)
    residual: Array  # (C,) sum of squares
    usable: bool


def solve(plan: Plan, gram: Array, bias: tuple[Array, Array] | None = None) -> Solution:
    """Solve (Z'A - bias) theta = Z'y - bias from a summed Gram matrix (W, W); ``bias`` is from ``bias_of``.

    Least squares, Z = A, by Cholesky factors; instrumental variables by LU.
    """
    normal, right = gram.take(plan.normal), gram.take(plan.right)
    normal *= plan.same
    right *= plan.mine
    matrix, sides = normal, right
    if not plan.least_squares:
        matrix, sides = gram.take(plan.cross) * plan.same, gram.take(plan.sides) * plan.mine
    if bias is not None:
        matrix, sides = matrix - bias[0], sides - bias[1]
    P = plan.columns.size
    known = np.empty((P, P + sides.shape[1]), order="F")
    known[:, :P] = plan.unit
    known[:, P:] = sides
    solver = dposv if plan.least_squares else dgesv
    *_, solved, fault = solver(matrix, known, overwrite_b=True)
    squares = gram.take(plan.square)
    if fault or not math.isfinite(solved[0, 0]):
        return Solution(np.zeros_like(right), np.zeros((P, P)), squares, False)
    theta = solved[:, P:]
    # |y - A theta|^2, with the noise in it
    right *= -2.0
    right += normal @ theta
    right *= theta
    squares += right.sum(axis=0)
    return Solution(theta, solved[:, :P], np.maximum(squares, 0.0), True)


def bias_of(plan: Plan, bias: Array) -> tuple[Array, Array]:
    """The entries of a (W, W) expected noise Gram matrix that ``solve`` subtracts, (P, P) and (P, C)."""
    return bias.take(plan.cross) * plan.same, bias.take(plan.sides) * plan.mine


@dataclass
class Uncertainty:
    """What the residuals of all coefficients say of the estimates' covariance."""

    covariance: Array  # (C, P, P) of the unknowns, zero where they do not belong
    density: Array  # (C,) of the residual over the whole band
    bands: Array  # (C, B) of the residual in each band
    freedom: Array  # (C,) degrees of freedom


def uncertainty(plan: Plan, solution: Solution, info: Information, scale_variance: Array) -> Uncertainty:
    """Sandwich covariance with the residual's spectral density estimated in each band.

    ``scale_variance`` (C,): of an error that scales all derivatives of a coefficient alike. Noise in the airspeed makes
    one: it multiplies the motion, so it is there when the motion is, which a stationary density does not know.
    """
    C, P = len(plan.coefficients), plan.columns.size
    if not solution.usable or info.trace_square <= 0.0:
        return Uncertainty(np.zeros((C, P, P)), np.zeros(C), np.zeros((C, BANDS)), np.zeros(C))
    v = np.zeros((plan.width, C))
    np.add.at(v, (plan.columns[:, None], np.arange(C)), -solution.theta)
    v[plan.outputs, np.arange(C)] = 1.0
    squares = np.maximum(((info.grams @ v) * v).sum(axis=1), 0.0).T  # (C, B)
    scores = info.scores[:, plan.instruments[:, None], plan.instruments] * plan.same
    used = ((scores * solution.inverse.T).sum(axis=2) @ plan.mine).T  # (C, B): taken up by the unknowns
    expected = np.maximum(info.traces - used, 0.05 * info.traces + TINY)
    whole = expected.sum(axis=1)
    density = squares.sum(axis=1) / whole
    freedom = whole**2 / info.trace_square
    share = expected * (freedom / whole)[:, None]
    bands = (share * squares / expected + BAND_PRIOR * density[:, None]) / (share + BAND_PRIOR)
    middle = np.tensordot(bands, scores, axes=(1, 0))  # (C, P, P)
    covariance = solution.inverse @ middle @ solution.inverse.T
    covariance += scale_variance[:, None, None] * (solution.theta.T[:, :, None] * solution.theta.T[:, None, :])
    covariance *= plan.mine.T[:, :, None] * plan.mine.T[:, None, :]
    return Uncertainty(covariance, density, bands, freedom)


def strength(plan: Plan, solution: Solution, info: Information) -> Array:
    """(P,) the F statistic of each instrumented regressor: what instruments explain of it over what they do not.

    Under about 10 the estimates are those of weak instruments, far from normal (Stock & Yogo, "Testing for weak
    instruments in linear IV regression", 2005). Infinite where every regressor is its own instrument.
    """
    if plan.least_squares:
        return np.full(plan.columns.size, np.inf)
    if not solution.usable or info.trace_square <= 0.0:
        return np.zeros(plan.columns.size)
    gram = info.grams.sum(axis=0)
    outer = gram[plan.instruments[:, None], plan.instruments] * plan.same
    best = np.linalg.pinv(gram.take(plan.normal) * plan.same, hermitian=True).diagonal()
    achieved = (solution.inverse @ outer @ solution.inverse.T).diagonal()
    efficiency = np.clip(best / np.maximum(achieved, TINY), 0.0, 1.0 - 1e-9)
    freedom = float(info.traces.sum()) ** 2 / info.trace_square
    statistic: Array = freedom * efficiency / (1.0 - efficiency)
    return statistic


def student_95(freedom: Array) -> Array:
    """Two-sided 95 % quantile of Student's t."""
    return np.asarray(stdtrit(np.maximum(freedom, 1.0), 0.975))


def collinear_with(plan: Plan, solution: Solution, unknown: int) -> str:
    """The regressor whose estimate is most correlated with this one's."""
    spread = np.sqrt(np.abs(solution.inverse.diagonal()))
    correlation = np.abs(solution.inverse[unknown]) / (spread * spread[unknown]) * plan.same[unknown]
    correlation[unknown] = -1.0
    return plan.regressors[int(np.argmax(correlation))]
