"""From the estimator's state to what is published: values, 95 % intervals, and whether to believe them.

``present`` is the least-squares solution at the last sample; ``estimate`` names it, judges it and wraps it up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.online import regression, signals, transform
from sysid_node.online.information import products
from sysid_node.online.prior import beliefs, weighed
from sysid_node.online.regression import Solution, student_95
from sysid_node.online.signals import OFFSET
from sysid_node.online.state import Renewed, State
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality

Array = NDArray[np.float64]

ENOUGH_FREEDOM = 6.0  # degrees of freedom under which an interval is not trusted
HOPELESS = 1e4  # variance inflation beyond which regressors cannot be told apart at all
COLLINEAR = 10.0  # ... beyond which collinearity is named as the reason for a wide interval
STALE = 0.5  # s without a new sample
SETTLING = 1.0  # s after an abrupt change in which "changed" is said
BURIED = 3.0  # times its sensor's noise energy that a regressor must move


@dataclass
class Present:
    """The solution at the last sample: P unknowns, C coefficients, W signals."""

    solution: Solution
    variance: Array  # (P, C) squared standard errors
    gram: Array  # (W, W)
    integrals: Array  # (T,) of the present segment's transformed signals


def present(state: State) -> Present | None:
    """Solve for the derivatives with every sample so far; None before the first half second of data."""
    renewed, last = state.renewed, state.transform.last
    if renewed is None or state.segment is None:
        return None
    part = transform.current(state.transform)
    rate = state.model.spectrum.rate
    part -= state.segment * math.exp(0.5 * rate * (state.segment_start - last)) if rate else state.segment
    gram = products(part, state.model.auxiliary)
    gram += renewed.base
    # since the last renewal the noise's part has grown, and the variances shrunk, with the time counted
    energy = renewed.total.energy
    growth = (energy + max(last - state.piece_start, 0.0)) / max(energy, 1e-9)
    noise = renewed.compensation
    solution = regression.solve(state.plan, gram, None if noise is None else noise * growth)
    variance = renewed.factors * solution.residual
    variance *= np.abs(solution.inverse.diagonal())[:, None] / growth
    return Present(solution, variance, gram, part[-1])


def estimate(state: State, now: float | None = None) -> Estimates:
    """All derivatives of the aircraft's model with their intervals; ``now`` (s) tells how old the last sample is."""
    current = present(state)
    if current is None or state.renewed is None:
        names = (f"{c}_{r}" for c, regressors in state.model.aircraft.structure.items() for r in regressors)
        return Estimates(state.transform.last, {name: _unknown(state, name) for name in names}, {})
    table = state.model.table
    if state.model.settings.use_prior:
        _count_beliefs(state, state.renewed, current)
    slopes, errors = current.solution.theta, np.sqrt(np.maximum(current.variance, 0.0))
    offsets, offset_errors = _offsets(state, state.renewed, current)
    quantiles = student_95(state.renewed.uncertainty.freedom)
    values = np.where(table.offset, offsets[table.coefficient], slopes[table.unknown, table.coefficient]).tolist()
    spreads = np.where(table.offset, offset_errors[table.coefficient], errors[table.unknown, table.coefficient])
    halves = (quantiles[table.coefficient] * spreads).tolist()
    judged = _judge(state, state.renewed, current, np.asarray(values), spreads, now)
    derivatives = {
        name: DerivativeEstimate(name, value, error, value - half, value + half, status == "ok", status)
        for name, value, error, half, status in zip(table.names, values, spreads.tolist(), halves, judged, strict=True)
    }
    for name in table.unformed:
        derivatives[name] = _unknown(state, name)
    return Estimates(state.transform.last, derivatives, _fits(state, state.renewed, current))


def _count_beliefs(state: State, renewed: Renewed, current: Present) -> None:
    """Weigh the solution with the aircraft file's derivatives."""
    plan = state.plan
    theta, covariance = weighed(
        plan, current.solution.theta, renewed.uncertainty.covariance, *beliefs(state.model.aircraft, plan)
    )
    current.solution.theta = theta
    current.variance = covariance.diagonal(axis1=1, axis2=2).T.copy()


def _unknown(state: State, name: str) -> DerivativeEstimate:
    """A derivative of which nothing is known, and why."""
    reason = signals.unformed(state.model.aircraft).get(name.partition("_")[0])
    if reason is None and state.incomplete and state.samples == 0:
        column = max(state.incomplete, key=lambda column: state.incomplete[column])
        reason = f"{column} not measured"
    return DerivativeEstimate(name, math.nan, math.inf, -math.inf, math.inf, False, reason or "converging")


def _offsets(state: State, renewed: Renewed, current: Present) -> tuple[Array, Array]:
    """(C,) offsets and standard errors, from the signals' integrals: k C_0 = y - sum k C_j x_j at zero frequency."""
    plan = state.plan
    past = renewed.total.integrals - (state.present.integrals if state.present is not None else 0.0)
    integrals = past + current.integrals
    weight = float(integrals[OFFSET])
    if not weight > 0.0:
        return np.full(plan.outputs.size, np.nan), np.full(plan.outputs.size, np.inf)
    x = integrals[plan.columns] / weight
    values = integrals[plan.outputs] / weight - x @ current.solution.theta
    variance = renewed.uncertainty.bands[:, 0] * (renewed.total.energy / weight**2)
    variance += renewed.uncertainty.covariance @ x @ x
    return values, np.sqrt(np.maximum(variance, 0.0))


def _fits(state: State, renewed: Renewed, current: Present) -> dict[str, FitQuality]:
    """Quality of the fit of each coefficient."""
    plan = state.plan
    start, _, stop = state.model.settings.frequencies
    motion = current.gram.take(plan.square)
    explained = 1.0 - current.solution.residual / np.maximum(motion, 1e-300)
    deviations = np.sqrt(2.0 * (stop - start) * renewed.uncertainty.density)
    rows = zip(
        plan.coefficients,
        np.clip(explained, 0.0, 1.0).tolist(),
        deviations.tolist(),
        renewed.uncertainty.freedom.tolist(),
        strict=True,
    )
    return {row[0]: FitQuality(*row, round(renewed.total.samples)) for row in rows}


def _judge(
    state: State, renewed: Renewed, current: Present, values: Array, errors: Array, now: float | None
) -> list[str]:
    """(D,) why each estimate is not to be believed, or "ok"."""
    table, plan = state.model.table, state.plan
    everywhere = _whole(state, current, now)
    if everywhere:
        return [everywhere] * len(table.names)
    columns = plan.columns[table.unknown]
    motion = current.gram[columns, columns]
    inflation = np.where(table.offset, 1.0, current.solution.inverse[table.unknown, table.unknown] * motion)
    sizes = np.where(table.size > 0.0, table.size, np.abs(values))
    small = errors <= state.model.settings.valid_fraction * sizes
    trusted = renewed.uncertainty.freedom >= ENOUGH_FREEDOM
    good = small & (inflation <= HOPELESS)
    good &= (trusted & ~renewed.lost)[table.coefficient]
    good &= table.offset | (renewed.strength >= regression.STRONG)[table.unknown]
    spoilt = renewed.timing.spoilt[table.unknown, table.coefficient] & ~table.offset
    good &= ~spoilt
    if not state.thrust_known:
        good &= ~table.needs_thrust
    statuses = ["ok"] * len(table.names)
    for i in np.flatnonzero(~good).tolist():
        c, unknown = int(table.coefficient[i]), int(table.unknown[i])
        if renewed.lost[c]:
            statuses[i] = "outside model"
        elif not state.thrust_known and table.needs_thrust[i]:
            statuses[i] = "thrust not measured"
        elif not trusted[c]:
            statuses[i] = "converging"
        elif spoilt[i]:
            statuses[i] = f"{renewed.timing.blamed[c]} not on time"
        elif inflation[i] > COLLINEAR:
            statuses[i] = f"collinear with {regression.collinear_with(plan, current.solution, unknown)}"
        elif not table.offset[i] and motion[i] < BURIED * renewed.total.bias[columns[i], columns[i]]:
            statuses[i] = "not excited"
        else:
            statuses[i] = "converging"
    return statuses


def _whole(state: State, current: Present, now: float | None) -> str:
    """What holds of all estimates alike, if anything does."""
    last = state.transform.last
    if now is not None and now - last > STALE:
        return "stale input"
    if last - state.changed_at < SETTLING:
        return "changed"
    return "" if current.solution.usable else "not excited"
