"""Least squares on the information matrices: values, covariances, and the strength of the instruments."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv, dposv
from scipy.special import stdtrit

from sysid_node.online.regression import heteroskedasticity
from sysid_node.online.regression.information import BANDS, Information
from sysid_node.online.regression.normal_equations import Index, NormalEquations, least_squares_of

Array = NDArray[np.float64]

#: Weight of the mean density, in degrees of freedom, when the residual's density in one band is estimated.
BAND_PRIOR = 8.0
#: Energy under which a regressor has not moved at all.
TINY = 1e-18
#: Share of its energy by which a regressor is set apart from others where their equations are singular.
RIDGE = 1e-12
#: Share of an output's energy that is rounding: no residual is smaller.
ROUNDING = 1e-14


@dataclass
class Solution:
    """Solution of all coefficients' normal equations. ``usable`` is False where the equations are singular."""

    theta: Array  # (P, C), zero where an unknown does not belong
    inverse: Array  # (P, P) of Z'A (of A'A in least squares)
    residual: Array  # (C,) sum of squares
    motion: Array  # (C,) sum of squares of what is to be explained
    usable: bool | NDArray[np.bool_]  # an array where solutions are stacked


def solve(equations: NormalEquations, gram: Array, bias: Array | None = None) -> Solution:
    """Solve (Z'A - bias) theta = Z'y - bias from a summed Gram matrix (W, W); ``bias`` is from ``bias_of``.

    Least squares, Z = A, by Cholesky factors; instrumental variables by LU.
    """
    P, flat = equations.columns.size, gram.reshape(-1)
    gathered = flat.take(equations.entries.normal)
    gathered *= equations.entries.counted
    normal, cross = gathered[0], gathered[1]
    if bias is not None:
        cross -= bias
    solved, usable = _factorised(equations, cross)
    theta = solved[:, P:]
    # |y - A theta|^2 = y'y + theta' (A'A theta - 2 A'y), with the noise in it
    bracket = theta.T.dot(normal[:P])
    bracket -= normal[P:]
    motion = flat.take(equations.entries.square)
    residual: Array = np.maximum(bracket.dot(theta).diagonal() + motion, ROUNDING * motion)
    return Solution(theta, solved[:, :P], residual, motion, usable)


def _factorised(equations: NormalEquations, cross: Array) -> tuple[Array, bool]:
    """(P, P + C) the inverse and the solutions of what is gathered (P + C, P), zero and False where there are none."""
    solved, fault = _factorise(equations, cross)
    if fault:
        # a regressor that has not moved, or that moved as others did: its own estimate is lost, not all of them
        P = equations.columns.size
        ridged = cross.copy()
        ridged[:P] += equations.structure.unit * (RIDGE * np.abs(cross[:P].diagonal()) + TINY)
        solved, fault = _factorise(equations, ridged)
    if fault or not math.isfinite(solved[0, 0]):
        return np.zeros_like(solved), False
    return solved, True


def _factorise(equations: NormalEquations, cross: Array) -> tuple[Array, int]:
    """(P, P + C) the inverse and the solutions of what is gathered (P + C, P), and LAPACK's fault, 0 for none."""
    P = equations.columns.size
    known = equations.entries.known.copy()
    known[P:] = cross[P:]
    solver = dposv if equations.least_squares else dgesv
    *_, solved, fault = solver(cross[:P].T, known.T)
    return solved, fault


def bias_of(equations: NormalEquations, bias: Array) -> Array:
    """(P + C, P) the entries of a (W, W) expected noise Gram matrix that ``solve`` subtracts."""
    return np.asarray(bias.take(equations.entries.normal[1]) * equations.entries.counted[1])


def residual_combinations(equations: NormalEquations, theta: Array) -> Array:
    """(W, C) the combinations of signals y - sum theta_j x_j that ``theta`` (P, C) leaves of each coefficient."""
    C = equations.outputs.size
    v = np.zeros((equations.width, C))
    np.add.at(v, (equations.columns[:, None], np.arange(C)), -theta)
    v[equations.outputs, np.arange(C)] = 1.0
    return v


@dataclass
class Uncertainty:
    """What the residuals of all coefficients say of the estimates' covariance."""

    covariance: Array  # (C, P, P) of the unknowns, zero where they do not belong
    density: Array  # (C,) of the residual over the whole band
    bands: Array  # (C, B) of the residual in each band
    freedom: Array  # (C,) degrees of freedom

    def residual_std(self, band: float) -> Array:
        """(C,) standard deviation of the residuals within a ``band`` (Hz); NaN where rounding makes a density negative.

        That happens in the first few samples, of which nothing is valid.
        """
        std: Array = np.sqrt(np.where(self.density < 0.0, np.nan, 2.0 * band * self.density))
        return std


def uncertainty(equations: NormalEquations, solution: Solution, info: Information) -> Uncertainty:
    """Sandwich covariance with the residual's density estimated in each band, and with noise that comes and goes."""
    structure = equations.structure
    C, P = len(structure.coefficients), equations.columns.size
    if not solution.usable or info.trace_square <= 0.0:
        return Uncertainty(np.zeros((C, P, P)), np.zeros(C), np.zeros((C, BANDS)), np.zeros(C))
    v = residual_combinations(equations, solution.theta)
    least = ROUNDING * info.grams[:, equations.outputs, equations.outputs]
    squares = np.maximum(((info.grams @ v) * v).sum(axis=1), least).T  # (C, B)
    scores = info.scores[:, equations.instruments[:, None], equations.instruments] * structure.same_block
    used = ((scores * solution.inverse.T).sum(axis=2) @ structure.belongs).T  # (C, B): taken up by the unknowns
    expected = np.maximum(info.traces - used, 0.05 * info.traces + TINY)
    whole = expected.sum(axis=1)
    density = squares.sum(axis=1) / whole
    freedom = whole**2 / info.trace_square
    share = expected * (freedom / whole)[:, None]
    bands = (share * squares / expected + BAND_PRIOR * density[:, None]) / (share + BAND_PRIOR)
    middle = np.tensordot(bands, scores, axes=(1, 0))  # (C, P, P)
    middle += heteroskedasticity.heteroskedastic_excess(
        info.noise_moments, scores.sum(axis=0), structure.same_block, density
    )
    covariance = solution.inverse @ middle @ solution.inverse.T
    covariance *= structure.belongs.T[:, :, None] * structure.belongs.T[:, None, :]
    return Uncertainty(covariance, density, bands, freedom)


class InstrumentStrength(NamedTuple):
    """Strength of the instruments of each of the P unknowns."""

    strength: Array  # F statistic: what instruments explain of a regressor over what they do not
    selection_factor: Array  # variance expected without chance correlation, over the variance found; at least 1


def instrument_strength(equations: NormalEquations, solution: Solution, info: Information) -> InstrumentStrength:
    """The instruments' strength, and the factor that corrects variances for chance correlation.

    Under an F of about 10 estimates are those of weak instruments, far from normal (Stock & Yogo, "Testing for weak
    instruments in linear IV regression", 2005). Infinite where every regressor is its own instrument.

    Instruments are the response of the aircraft file's model to the deflections, so that the expected Z'A is Z'Z. Where
    chance correlation adds to it, instruments seem strong, and small standard errors and large errors occur together.
    The strength is therefore that of Z'Z where this is less; ``selection_factor`` is the ratio of the variances.
    """
    structure = equations.structure
    P = equations.columns.size
    if equations.least_squares:
        return InstrumentStrength(np.full(P, np.inf), np.ones(P))
    if not solution.usable or info.trace_square <= 0.0:
        return InstrumentStrength(np.zeros(P), np.ones(P))
    gram = info.grams.sum(axis=0)
    outer = gram[equations.instruments[:, None], equations.instruments] * structure.same_block
    plain = solve(least_squares_of(equations), gram)
    if not plain.usable:
        return InstrumentStrength(np.zeros(P), np.ones(P))
    achieved = np.maximum((solution.inverse @ outer @ solution.inverse.T).diagonal(), TINY)
    ridged = outer + structure.unit * (RIDGE * outer.diagonal() + TINY)
    expected = np.maximum(np.linalg.inv(ridged).diagonal(), achieved)
    efficiency = np.clip(plain.inverse.diagonal() / expected, 0.0, 1.0 - 1e-9)
    freedom = float(info.traces.sum()) ** 2 / info.trace_square
    statistic: Array = freedom * efficiency / (1.0 - efficiency)
    statistic[outer.diagonal() <= TINY] = 0.0  # no instrument at all
    return InstrumentStrength(statistic, expected / achieved)


def student_95(freedom: Array) -> Array:
    """Two-sided 95 % quantile of Student's t."""
    return np.asarray(stdtrit(np.maximum(freedom, 1.0), 0.975))


def most_correlated(equations: NormalEquations, solution: Solution) -> Index:
    """(P,) of each unknown the one of the same equation whose estimate is most correlated with its own."""
    structure = equations.structure
    spread = np.sqrt(np.abs(solution.inverse.diagonal()))
    # each row's own spread is common to all of it
    correlation = np.abs(solution.inverse) / np.maximum(spread, 1e-150)
    correlation *= structure.others.T  # it is symmetric, and lies as LAPACK's inverse does
    partner: Index = correlation.argmax(axis=-1)
    return partner
