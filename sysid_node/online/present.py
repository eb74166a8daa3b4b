"""The least-squares solution with all samples so far, at one moment or at several since the last renewal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.online import regression, transform
from sysid_node.online.information import products
from sysid_node.online.prior import weighed
from sysid_node.online.regression import Solution
from sysid_node.online.signals import OFFSET
from sysid_node.online.state import Renewed, State

Array = NDArray[np.float64]


@dataclass
class Present:
    """What is solved for at K moments: P unknowns, C coefficients, W signals."""

    time: Array  # (K,) s, of the last sample
    solution: Solution  # of K moments
    variance: Array  # (K, P, C) squared standard errors
    gram: Array  # (K, W, W)
    integrals: Array  # (K, T) of the present segment's transformed signals
    diagonal: Array  # (K, P) size of the inverse's diagonal


def present(state: State) -> Present | None:
    """Solve for the derivatives with every sample so far; None before the first half second of data."""
    return present_at(state, [transform.current(state.transform)], [state.transform.last])


def present_at(state: State, lines: Sequence[Array], times: Sequence[float]) -> Present | None:
    """The same at K ``times`` (s) since the last renewal, at which the transform was ``lines`` (2F + 1, T)."""
    renewed, rate = state.renewed, state.model.spectrum.rate
    if renewed is None:
        return None
    part = np.array(lines)
    if rate:
        left = np.array([math.exp(0.5 * rate * (state.segment_start - time)) for time in times])
        part -= state.segment * left[:, None, None]
    else:
        part -= state.segment
    gram = products(part, state.model.auxiliary)
    gram += renewed.base
    # since the last renewal the noise's part has grown, and the variances shrunk, with the time counted
    energy, since = renewed.total.energy, renewed.time
    growth = np.array([[[(energy + max(time - since, 0.0)) / max(energy, 1e-9)]] for time in times])
    noise = renewed.compensation
    solution = regression.solve(state.plan, gram, None if noise is None else noise * growth)
    diagonal = np.abs(solution.inverse.diagonal(axis1=1, axis2=2))
    variance = renewed.factors * solution.residual[:, None]
    variance *= diagonal[:, :, None] / growth
    return Present(np.array(times), solution, variance, gram, part[:, -1], diagonal)


def with_beliefs(state: State, renewed: Renewed, theta: Array) -> tuple[Array, Array]:
    """(K, P, C) the solutions ``theta`` weighed with the aircraft file's derivatives, and their variances."""
    several = [weighed(state.plan, one, renewed.uncertainty.covariance, *state.model.believed) for one in theta]
    variances = [covariance.diagonal(axis1=1, axis2=2).T for _, covariance in several]
    return np.array([values for values, _ in several]), np.array(variances)


def offsets(state: State, renewed: Renewed, current: Present, theta: Array) -> tuple[Array, Array]:
    """(K, C) offsets and their variances, from the signals' integrals: k C_0 = y - sum k C_j x_j at zero frequency.

    The slopes ``theta`` are (K, P, C).
    """
    plan = state.plan
    past = renewed.total.integrals - (state.present.integrals if state.present is not None else 0.0)
    integrals = past + current.integrals
    weight = np.where(integrals[:, OFFSET] > 0.0, integrals[:, OFFSET], np.nan)[:, None]
    x = integrals[:, plan.columns] / weight
    values = integrals[:, plan.outputs] / weight - (x[:, None] @ theta)[:, 0]
    covariance = renewed.uncertainty.covariance
    P = plan.columns.size
    spread = (covariance.reshape(-1, P) @ x[:, :, None]).reshape(len(x), -1, P) @ x[:, :, None]
    variance = renewed.uncertainty.bands[:, 0] * (renewed.total.energy / weight**2) + spread[:, :, 0]
    return values, np.where(np.isnan(variance), np.inf, variance)
