"""From the estimator's state to what is published: values, 95 % intervals, and whether to believe them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.online import status
from sysid_node.online.estimates.current_solution import Present, present, present_at
from sysid_node.online.estimates.rows import DerivativeRows, FitRows
from sysid_node.online.estimates.validity import grounds_of, judge
from sysid_node.online.frequency import regression_signals
from sysid_node.online.regression import weak_instruments
from sysid_node.online.state import Renewed, State
from sysid_node.online.status import Codes
from sysid_node.online.types import DerivativeEstimate, Estimates

Array = NDArray[np.float64]


def estimate(state: State, now: float | None = None) -> Estimates:
    """All derivatives of the aircraft's model with their intervals; ``now`` (s) tells how old the last sample is."""
    return estimate_of(state, present(state), now)


def estimate_of(state: State, current: Present | None, now: float | None = None) -> Estimates:
    """The same from what was just solved for."""
    time, renewed = state.transform.last, state.renewed
    if current is None or renewed is None:
        return Estimates(time, _nothing_known(state), {})
    return _named(state, time, *_told(state, renewed, current, time if now is None else now))


def estimates_at(state: State, lines: Array, times: Sequence[float], nows: Sequence[float]) -> list[Estimates]:
    """The same at K ``times`` (s) since the last renewal, when the transform was ``lines`` (K, 2F + 1, W)."""
    current, renewed = present_at(state, lines, np.array(times)), state.renewed
    if current is None or renewed is None:
        return [Estimates(time, _nothing_known(state), {}) for time in times]
    told = _told(state, renewed, current, np.array(nows))
    return [_named(state, time, *one) for time, *one in zip(times, *told, strict=True)]


def _told(state: State, renewed: Renewed, current: Present, now: Any) -> tuple[Array, Codes, Array]:
    """(..., D, 4) numbers and (..., D) statuses of the derivatives, (..., C, 4) numbers of the fits; see ``rows``."""
    codes = judge(state, renewed, current, now)
    values, variances = current.values, current.variances
    grounds, solution = grounds_of(state, renewed), current.solution
    below, above = weak_instruments.reach(grounds.squares * variances, renewed.bend)
    numbers = np.stack([values, np.sqrt(variances), values - below, values + above], axis=-1)
    missing = len(state.model.table.unformed)
    if missing:
        lacking = np.array([math.nan, math.inf, -math.inf, math.inf])
        numbers = np.concatenate([numbers, np.broadcast_to(lacking, (*codes.shape[:-1], missing, 4))], axis=-2)
        unknown = np.full((*codes.shape[:-1], missing), status.INERTIA, codes.dtype)
        codes = np.concatenate([codes, unknown], axis=-1)
    fits = np.empty((*solution.motion.shape, 4))
    explained = 1.0 - solution.residual / np.maximum(solution.motion, 1e-300)
    fits[..., 0], fits[..., 1:] = np.minimum(np.maximum(explained, 0.0), 1.0), grounds.fits
    return numbers, codes, fits


def _named(state: State, time: float, numbers: Array, codes: Codes, fits: Array) -> Estimates:
    """The estimates of one moment, of which ``_told`` has told."""
    model = state.model
    derivatives = DerivativeRows(model.table.all_names, numbers, codes, model.vocabulary)
    return Estimates(time, derivatives, FitRows(model.plan.coefficients, fits))


def _nothing_known(state: State) -> dict[str, DerivativeEstimate]:
    """All derivatives before there is anything to solve."""
    every = (f"{c}_{r}" for c, regressors in state.model.aircraft.model_structure.items() for r in regressors)
    return {name: _unknown(state, name) for name in every}


def _unknown(state: State, name: str) -> DerivativeEstimate:
    """A derivative of which nothing is known, and why."""
    reason = regression_signals.unformed(state.model.aircraft).get(name.partition("_")[0])
    if reason is None and state.incomplete and state.samples == 0:
        column = max(state.incomplete, key=lambda column: state.incomplete[column])
        reason = f"{column} not measured"
    return DerivativeEstimate(name, math.nan, math.inf, -math.inf, math.inf, False, reason or "converging")
