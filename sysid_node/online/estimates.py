"""From the estimator's state to what is published: values, 95 % intervals, and whether to believe them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.online import interval, judgement, signals
from sysid_node.online.present import Present, offsets, present, present_at, with_beliefs
from sysid_node.online.rows import DerivativeRows, FitRows
from sysid_node.online.state import Grounds, State
from sysid_node.online.types import DerivativeEstimate, Estimates

Array = NDArray[np.float64]


def estimate(state: State, now: float | None = None) -> Estimates:
    """All derivatives of the aircraft's model with their intervals; ``now`` (s) tells how old the last sample is."""
    last = state.transform.last
    return estimates_of(state, present(state), [last], [last if now is None else now])[0]


def estimates_at(
    state: State, lines: Sequence[Array], times: Sequence[float], nows: Sequence[float]
) -> list[Estimates]:
    """The same at several ``times`` (s) since the last renewal, at which the transform was ``lines`` (2F + 1, T)."""
    return estimates_of(state, present_at(state, lines, times), times, nows)


def estimates_of(
    state: State, current: Present | None, times: Sequence[float], nows: Sequence[float]
) -> list[Estimates]:
    """The same from what was solved for at ``times`` (s)."""
    renewed = state.renewed
    if current is None or renewed is None:
        every = [f"{c}_{r}" for c, regressors in state.model.aircraft.structure.items() for r in regressors]
        return [Estimates(time, {name: _unknown(state, name) for name in every}, {}) for time in times]
    table = state.model.table
    grounds = renewed.grounds = renewed.grounds or judgement.grounds(state, renewed)
    theta, variance, K = current.solution.theta, current.variance, len(times)
    if state.model.settings.use_prior:
        theta, variance = with_beliefs(state, renewed, theta)
    constants, constant_variances = offsets(state, renewed, current, theta)
    values = np.concatenate([theta.reshape(K, -1), constants], axis=1).take(table.place, axis=1)
    variances = np.concatenate([variance.reshape(K, -1), constant_variances], axis=1).take(table.place, axis=1)
    variances = np.maximum(variances, 0.0)
    errors = np.sqrt(variances)
    below, above = interval.reach(grounds.squares * variances, renewed.bend)
    bounded = np.where(np.isinf(above), np.inf, errors)
    statuses = judgement.judge(state, renewed, grounds, current, values, bounded, nows)
    numbers = np.stack([values, errors, values - below, values + above], axis=1)
    names = table.names
    if table.unformed:
        missing = [_unknown(state, name) for name in table.unformed]
        lacking = np.array([row[1:5] for row in missing]).T
        numbers = np.concatenate([numbers, np.broadcast_to(lacking, (K, *lacking.shape))], axis=2)
        names += table.unformed
        statuses = [status + tuple(row.status for row in missing) for status in statuses]
    return [
        Estimates(time, DerivativeRows(names, *row), fit)
        for time, *row, fit in zip(times, numbers, statuses, _fits(state, grounds, current), strict=True)
    ]


def _unknown(state: State, name: str) -> DerivativeEstimate:
    """A derivative of which nothing is known, and why."""
    reason = signals.unformed(state.model.aircraft).get(name.partition("_")[0])
    if reason is None and state.incomplete and state.samples == 0:
        column = max(state.incomplete, key=lambda column: state.incomplete[column])
        reason = f"{column} not measured"
    return DerivativeEstimate(name, math.nan, math.inf, -math.inf, math.inf, False, reason or "converging")


def _fits(state: State, grounds: Grounds, current: Present) -> list[FitRows]:
    """Quality of each coefficient's fit at each of the K moments."""
    squares = current.gram.reshape(len(current.time), -1).take(state.plan.square, axis=1)
    explained = 1.0 - current.solution.residual / np.maximum(squares, 1e-300)
    shares = np.minimum(np.maximum(explained, 0.0), 1.0)
    return [FitRows(state.plan.coefficients, row, grounds.fits) for row in shares]
