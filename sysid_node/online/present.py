"""The solution with all samples so far: every derivative and its variance, at one moment or at several.

Several moments since the last renewal stand along an axis in front of all others (...); one moment has none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.online import regression, transform
from sysid_node.online.information import products
from sysid_node.online.prior import weighed
from sysid_node.online.regression import Plan, Solution
from sysid_node.online.signals import OFFSET
from sysid_node.online.state import Renewed, State

Array = NDArray[np.float64]


@dataclass
class Present:
    """What is solved for: D derivatives, P unknowns, C coefficients, W signals."""

    time: Any  # (...) s, of the last sample
    values: Array  # (..., D)
    variances: Array  # (..., D) squared standard errors
    solution: Solution
    slopes: Array  # (..., P, C) squared standard errors of the solution, before beliefs are counted in
    gram: Array  # (..., W, W)
    diagonal: Array  # (..., P) size of the inverse's diagonal


def present(state: State) -> Present | None:
    """Solve for the derivatives with every sample so far; None before the first half second of data."""
    return present_at(state, transform.current(state.transform), state.transform.last)


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
    # since the last renewal the noise's part has grown, and the variances shrunk, with the time counted
    energy, noise = renewed.total.energy, renewed.compensation
    growth = (energy + (time - renewed.time)) / max(energy, 1e-9)
    if lines.ndim > 2:
        growth = growth[:, None, None]
    solution = regression.solve(plan, gram, None if noise is None else noise * growth)
    diagonal = np.abs(solution.inverse.diagonal(axis1=-2, axis2=-1))
    slopes = renewed.factors * solution.residual[..., None, :]
    slopes *= diagonal[..., :, None] / growth
    theta, variances = solution.theta, slopes
    if state.model.settings.use_prior:
        theta, variances = _with_beliefs(state, renewed, theta)
    P, C = plan.mine.shape
    found = np.empty((*theta.shape[:-2], 2, P + 1, C))  # values and variances of slopes, and below them of offsets
    found[..., 0, :P, :], found[..., 1, :P, :] = theta, variances
    found[..., 0, P, :], found[..., 1, P, :] = _offsets(plan, renewed, integrals, theta)
    table = found.reshape(*found.shape[:-2], -1).take(state.model.table.place, axis=-1)
    return Present(time, table[..., 0, :], np.maximum(table[..., 1, :], 0.0), solution, slopes, gram, diagonal)


def _with_beliefs(state: State, renewed: Renewed, theta: Array) -> tuple[Array, Array]:
    """(..., P, C) the solutions ``theta`` weighed with the aircraft file's derivatives, and their variances."""
    values, covariance = weighed(state.plan, theta, renewed.uncertainty.covariance, *state.model.believed)
    return values, covariance.diagonal(axis1=1, axis2=2).T


def _offsets(plan: Plan, renewed: Renewed, integrals: Array, theta: Array) -> tuple[Array, Array]:
    """(..., C) offsets and their variances, from the ``integrals`` (..., W) of all signals.

    At zero frequency k C_0 = y - sum k C_j x_j, with the slopes ``theta`` (..., P, C).
    """
    P, C = plan.mine.shape
    weight = integrals[..., OFFSET, None]
    means = integrals.take(plan.sides, axis=-1) / weight
    x = means[..., None, :P]
    values = means[..., P:] - (x @ theta)[..., 0, :]
    # x' covariance x as one product of all pairs
    pairs = (x.swapaxes(-1, -2) * x).reshape(*x.shape[:-1], P * P)
    spread = (pairs @ renewed.uncertainty.covariance.reshape(C, P * P).T)[..., 0, :]
    return values, spread + renewed.trim_noise / (weight * weight)
