"""From the estimator's state to what is published: values, 95 % intervals, and whether to believe them.

Runs at every sample: only what moves from sample to sample is computed here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.online import regression, signals, transform
from sysid_node.online.estimator import Renewed, State
from sysid_node.online.information import about_mean, inverse2
from sysid_node.online.regression import Solution, student_95
from sysid_node.online.signals import OFFSET
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality

Array = NDArray[np.float64]

ENOUGH_FREEDOM = 6.0  # degrees of freedom under which an interval is not trusted
HOPELESS = 1e4  # variance inflation beyond which regressors cannot be told apart at all
COLLINEAR = 10.0  # ... beyond which collinearity is named as the reason for a wide interval
STALE = 0.5  # s without a new sample
SETTLING = 1.0  # s after an abrupt change in which "changed" is said
_NUISANCES = slice(OFFSET + 1, OFFSET + 3)


@dataclass
class Present:
    """The solution at the last sample: P unknowns, C coefficients."""

    solution: Solution
    standard_errors: Array  # (P, C)
    gram: Array  # (W, W)
    integrals: Array  # (W,) of the present segment


def present(state: State) -> Present | None:
    """Solve for the derivatives with every sample so far; None before the first half second of data."""
    renewed = state.renewed
    if renewed is None or state.segment is None:
        return None
    fading = math.exp((state.segment_start - state.transform.last) / (2.0 * state.model.memory))
    part = transform.current(state.transform) - state.segment * fading
    lines = about_mean(part)
    gram = lines.T @ lines
    border = gram[:, _NUISANCES]
    gram -= border @ inverse2(border[_NUISANCES]) @ border.T
    gram += renewed.base
    energy = renewed.total.energy
    growth = (energy + max(state.transform.last - state.piece_start, 0.0)) / energy if energy > 0.0 else 1.0
    solution = regression.solve(state.model.plan, gram, renewed.compensation * growth)
    variance = solution.inverse.diagonal()[:, None] * solution.residual * (renewed.factors / growth)
    return Present(solution, np.sqrt(np.maximum(variance, 0.0)), gram, part[-1])


def estimate(state: State, now: float | None = None) -> Estimates:
    """All derivatives of the aircraft's model with their intervals; ``now`` (s) tells how old the last sample is."""
    current = present(state)
    derivatives: dict[str, DerivativeEstimate] = {}
    fits: dict[str, FitQuality] = {}
    for coefficient, regressors in state.model.aircraft.structure.items():
        if current is None or coefficient not in state.model.plan.coefficients:
            reason = signals.unformed(state.model.aircraft).get(coefficient) or _waiting(state)
            for regressor in regressors:
                name = f"{coefficient}_{regressor}"
                derivatives[name] = _unknown(name, reason)
            continue
        c = state.model.plan.coefficients.index(coefficient)
        fits[coefficient] = _fit(state, current, c)
        for regressor in regressors:
            value, error = (_offset if regressor == "0" else _slope)(state, current, c, regressor)
            name = f"{coefficient}_{regressor}"
            status = _status(state, current, c, regressor, error, now)
            half = float(student_95(state.renewed.uncertainty.freedom[c])) * error
            derivatives[name] = DerivativeEstimate(name, value, error, value - half, value + half, status == "ok", status)
    return Estimates(state.transform.last, derivatives, fits)


def _unknown(name: str, reason: str) -> DerivativeEstimate:
    return DerivativeEstimate(name, math.nan, math.inf, -math.inf, math.inf, False, reason)


def _waiting(state: State) -> str:
    """Why there is nothing yet."""
    if state.incomplete and state.samples == 0:
        column = max(state.incomplete, key=lambda name: state.incomplete[name])
        return f"{column} not measured"
    return "converging"


def _unknown_index(state: State, c: int, regressor: str) -> int:
    plan = state.model.plan
    return next(int(i) for i in plan.unknowns(c) if plan.regressors[i] == regressor)


def _slope(state: State, current: Present, c: int, regressor: str) -> tuple[float, float]:
    i = _unknown_index(state, c, regressor)
    return float(current.solution.theta[i, c]), float(current.standard_errors[i, c])


def _offset(state: State, current: Present, c: int, regressor: str) -> tuple[float, float]:
    """Offset from the signals' integrals: k C_0 = y - sum k C_j x_j, at zero frequency."""
    plan, renewed = state.model.plan, state.renewed
    assert renewed is not None
    mine = plan.unknowns(c)
    past = renewed.total.integrals - (state.present.integrals if state.present is not None else 0.0)
    integrals = past + current.integrals
    weight = float(integrals[OFFSET])
    if not weight > 0.0:
        return math.nan, math.inf
    x = integrals[plan.columns[mine]] / weight
    value = float(integrals[plan.outputs[c]]) / weight - float(x @ current.solution.theta[mine, c])
    covariance = renewed.uncertainty.covariance[c][np.ix_(mine, mine)]
    variance = float(renewed.uncertainty.bands[c, 0]) * renewed.total.energy / weight**2 + float(x @ covariance @ x)
    return value, math.sqrt(max(variance, 0.0))


def _fit(state: State, current: Present, c: int) -> FitQuality:
    plan, renewed = state.model.plan, state.renewed
    assert renewed is not None
    y = int(plan.outputs[c])
    motion, residual = float(current.gram[y, y]), float(current.solution.residual[c])
    start, _, stop = state.model.settings.frequencies
    return FitQuality(
        coefficient=plan.coefficients[c],
        r_squared=min(max(1.0 - residual / motion, 0.0), 1.0) if motion > 0.0 else 0.0,
        residual_std=math.sqrt(2.0 * max(float(renewed.uncertainty.density[c]), 0.0) * (stop - start)),
        degrees_of_freedom=max(float(renewed.uncertainty.freedom[c]), 0.0),
        samples=round(renewed.total.samples),
    )


def _status(state: State, current: Present, c: int, regressor: str, error: float, now: float | None) -> str:
    """Why an estimate is not to be believed, or "ok"."""
    renewed, name = state.renewed, f"{state.model.plan.coefficients[c]}_{regressor}"
    assert renewed is not None
    if now is not None and now - state.transform.last > STALE:
        return "stale input"
    if state.transform.last - state.changed_at < SETTLING:
        return "changed"
    if renewed.lost[c]:
        return "outside model"
    if not current.solution.usable:
        return "not excited"
    if name in ("CD_0", "CL_0") and not state.thrust_known:
        return "thrust not measured"
    if renewed.uncertainty.freedom[c] < ENOUGH_FREEDOM:
        return "converging"
    inflation = 1.0
    if regressor != "0":
        i = _unknown_index(state, c, regressor)
        column = int(state.model.plan.columns[i])
        inflation = float(current.solution.inverse[i, i] * current.gram[column, column])
        if inflation > HOPELESS:
            return f"collinear with {regression.collinear_with(state.model.plan, current.solution, i)}"
    if error <= state.model.settings.valid_fraction * _size(state, name, c, regressor, current):
        return "ok"
    if regressor != "0" and inflation > COLLINEAR:
        return f"collinear with {regression.collinear_with(state.model.plan, current.solution, i)}"
    if regressor != "0" and _buried(current, renewed, column):
        return "not excited"
    return "converging"


def _size(state: State, name: str, c: int, regressor: str, current: Present) -> float:
    """What a standard error is measured against: the derivative's believed size, not its estimate, where there is a belief."""
    belief = state.model.aircraft.derivatives[name]
    size = max(abs(belief.value), 2.0 * (belief.tolerance or 0.0))
    if size > 0.0 or regressor == "0":
        return size
    return abs(float(current.solution.theta[_unknown_index(state, c, regressor), c]))


def _buried(current: Present, renewed: Renewed, column: int) -> bool:
    """Whether the regressor's motion is no larger than its sensor's noise."""
    motion = float(current.gram[column, column])
    return motion < 3.0 * max(float(renewed.total.bias[column, column]), 1e-12)
