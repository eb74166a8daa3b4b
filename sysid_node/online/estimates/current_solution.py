"""The solution with all samples so far: every derivative and its variance, at one moment or at several.

Several moments since the last renewal stand along an axis in front of all others (...); one moment has none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency import fourier_transform
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.regression import least_squares
from sysid_node.online.regression.information import products
from sysid_node.online.regression.least_squares import Plan, Solution
from sysid_node.online.regression.matrices import diagonal, product
from sysid_node.online.regression.mixed_estimation import weighed
from sysid_node.online.state import Renewed, State

Array = NDArray[np.float64]


@dataclass
class Present:
    """What is solved for: D derivatives, P unknowns, W signals."""

    time: Any  # (...) s, of the last sample
    values: Array  # (..., D)
    variances: Array  # (..., D) squared standard errors
    solution: Solution
    gram: Array  # (..., W, W)
    size: Array  # (..., P) of the inverse's diagonal


def present(state: State) -> Present | None:
    """Solve for the derivatives with every sample so far; None before the first half second of data."""
    return present_at(state, fourier_transform.current(state.transform), state.transform.last)


def present_at(state: State, lines: Array, time: Any) -> Present | None:
    """The same at ``time`` (...) s since the last renewal.

    ``lines`` (..., 2F + 1, W): the transform then, which is used up.
    """
    renewed, plan = state.renewed, state.plan
    if renewed is None:
        return None
    integrals = renewed.integrals + lines[..., -1, :]
    gram = products(lines, state.model.auxiliary)
    gram += renewed.base
    growth, noise = growth_since(renewed, time), renewed.compensation
    if lines.ndim > 2:
        growth = growth[:, None, None]
    solution = least_squares.solve(plan, gram, None if noise is None else noise * growth)
    size = np.abs(diagonal(solution.inverse))
    slopes = solution.theta.swapaxes(-1, -2)
    if state.model.settings.use_prior:
        slopes, variances = _with_beliefs(state, renewed, slopes)
    else:
        variances = slope_variances(renewed, solution.residual, size, growth)
    C, P = slopes.shape[-2:]
    told = np.empty((*slopes.shape[:-2], 2, C, P + 1))  # values and variances of the slopes and, behind them, offsets
    told[..., 0, :, :P], told[..., 1, :, :P] = slopes, variances
    told[..., 0, :, P], told[..., 1, :, P] = _offsets(plan, renewed, integrals, slopes)
    found = told.reshape(*slopes.shape[:-2], 2, C * (P + 1)).take(state.model.table.place, axis=-1)
    return Present(time, found[..., 0, :], np.maximum(found[..., 1, :], 0.0), solution, gram, size)


def slope_variances(renewed: Renewed, residual: Array, size: Array, growth: Any) -> Array:
    """(..., C, P) squared standard errors of the slopes, before beliefs are counted in; ``growth`` (..., 1, 1)."""
    variances = product(residual[..., None], size[..., None, :] / growth)
    variances *= renewed.factors
    return variances


def growth_since(renewed: Renewed, time: Any) -> Any:
    """How many times as much time is counted at ``time`` (...) s as at the last renewal.

    So much the noise's part in the equations has grown since, and the variances have shrunk.
    """
    energy = renewed.total.energy
    return (energy + (time - renewed.time)) / max(energy, 1e-9)


def _with_beliefs(state: State, renewed: Renewed, slopes: Array) -> tuple[Array, Array]:
    """(..., C, P) the ``slopes`` weighed with the aircraft file's derivatives, and (C, P) their variances."""
    covariance = renewed.uncertainty.covariance
    values, spread = weighed(state.plan, slopes.swapaxes(-1, -2), covariance, *state.model.believed)
    return values.swapaxes(-1, -2), spread.diagonal(axis1=1, axis2=2)


def _offsets(plan: Plan, renewed: Renewed, integrals: Array, slopes: Array) -> tuple[Array, Array]:
    """(..., C) offsets and their variances, from the ``integrals`` (..., W) of all signals.

    At zero frequency k C_0 = y - sum k C_j x_j, with the ``slopes`` (..., C, P).
    """
    P, C = plan.mine.shape
    weight, sums = integrals[..., OFFSET], integrals.take(plan.sides, axis=-1)
    if integrals.ndim > 1:
        weight = weight[:, None]
    x, y = sums[..., :P, None], sums[..., P:]
    left = y - product(slopes, x)[..., 0]
    # x' covariance x
    spread = product(product(renewed.uncertainty.covariance.reshape(C * P, P), x).reshape(slopes.shape), x)[..., 0]
    return left / weight, (spread + renewed.trim_noise) / weight / weight
