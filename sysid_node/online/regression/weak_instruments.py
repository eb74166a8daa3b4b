"""Intervals of instrumental-variable estimates, which reach further where instruments are weak.

The residual's density at the estimate is too small where the estimate lies, by chance, towards that of least squares,
which leaves the least residual. Anderson & Rubin (Annals of Mathematical Statistics 20, 1949) take the density at the
value that is tested instead. So the interval is all values at a distance delta from the estimate with

    delta^2 <= h^2 (1 + slope delta + curve delta^2),        h^2 = t^2 se^2 nu / (nu + t^2)

where the bracket is the residual's sum of squares over that at the estimate, nu degrees of freedom are in it, and the
other unknowns move along as their covariance with this one says. In least squares, where slope = 0 and curve = 1 / (nu
se^2), this is Student's interval; with instruments it leans away from least squares, and has no end where h^2 curve >=
1. Gusts are a few large eddies rather than as many independent numbers as there are lines: for their share of the
residual h = t se.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.regression.derivative_index import DerivativeIndex
from sysid_node.online.regression.least_squares import (
    ROUNDING,
    TINY,
    Solution,
    Uncertainty,
    residual_combinations,
    student_95,
)
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]


class AndersonRubinBounds(NamedTuple):
    """How the residual's sum of squares, relative to what it is, changes with each of D derivatives."""

    slope: Array  # (D,) per unit of the derivative
    curve: Array  # (D,) per unit squared
    counted: Array  # (D,) h^2 over t^2 se^2

    def longest(self, squares: Array) -> Array:
        """(D,) the largest squared standard errors whose intervals have an end, where ``squares`` (D,) are t^2."""
        bent = squares * self.counted * self.curve
        return np.divide(1.0 - 2.0 * ROUNDING, bent, out=np.full_like(bent, np.inf), where=bent > 0.0)


def anderson_rubin_bounds(
    equations: NormalEquations,
    table: DerivativeIndex,
    solution: Solution,
    gram: Array,
    spread: Uncertainty,
    noise: Array,
    mean: Array,
    gusts: Array,
) -> AndersonRubinBounds:
    """From the ``gram`` (W, W), the regressors' ``mean`` (P,), and the share of ``gusts`` (C,) in the residuals.

    ``noise`` (C, P, P): the part of the ``spread``'s covariance that comes from the residual; the rest does not bend.
    """
    covariance, P = spread.covariance, equations.columns.size
    v = residual_combinations(equations, solution.theta)
    gradient = (gram[equations.columns] @ v).T * equations.structure.belongs.T  # (C, P)
    normal = gram[equations.columns[:, None], equations.columns] * equations.structure.same_block
    in_offset = covariance @ mean
    ways = np.empty((*covariance.shape[:2], P + 1))  # how the slopes move with each, and behind them with the offset
    ways[:, :, :P] = covariance / np.maximum(covariance.diagonal(axis1=1, axis2=2), TINY)[:, None, :]
    ways[:, :, P] = -in_offset / np.maximum(in_offset @ mean, TINY)[:, None]
    scale = 1.0 / np.maximum(solution.residual, TINY)[:, None]
    with np.errstate(over="ignore", invalid="ignore"):
        slope = (gradient[:, None] @ ways)[:, 0] * (-2.0 * scale)
        curve = ((normal @ ways) * ways).sum(axis=1) * scale
    instrumented = equations.instrumented[table.coefficient]
    place = table.coefficient, np.where(table.offset, P, table.unknown)
    square = student_95(spread.freedom) ** 2
    counted = ((spread.freedom + gusts * square) / (spread.freedom + square))[table.coefficient]
    share = np.where(
        instrumented, _variances(noise, mean)[place] / np.maximum(_variances(covariance, mean)[place], TINY), 0.0
    )
    return AndersonRubinBounds(share * slope[place], share * curve[place], 1.0 - share * (1.0 - counted))


def _variances(covariance: Array, mean: Array) -> Array:
    """(C, P + 1) of the slopes and of what they bring to the offset."""
    return np.concatenate([covariance.diagonal(axis1=1, axis2=2), (covariance @ mean @ mean)[:, None]], axis=1)


def interval_arms(squares: Array, bounds: AndersonRubinBounds) -> tuple[Array, Array]:
    """How far the intervals (D,) go below and above the estimates, of which ``squares`` are t^2 se^2."""
    h = squares * bounds.counted
    left = 1.0 - h * bounds.curve
    endless = left < ROUNDING
    some = np.count_nonzero(endless)
    if some:
        left[endless] = 1.0
    h /= left
    middle = (0.5 * bounds.slope) * h
    half = np.sqrt(middle * middle + h)
    below, above = half - middle, half + middle
    if some:
        below[endless] = above[endless] = np.inf
    return below, above
