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
from sysid_node.online.state import Grounds, Renewed, State
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality

Array = NDArray[np.float64]

ENOUGH_FREEDOM = 6.0  # degrees of freedom under which an interval is not trusted
HOPELESS = 1e4  # variance inflation beyond which regressors cannot be told apart at all
COLLINEAR = 10.0  # ... beyond which collinearity is named as the reason for a wide interval
STALE = 0.5  # s without a new sample
SETTLING = 1.0  # s after an abrupt change in which "changed" is said
POOR = 0.7  # share of a coefficient's motion left unexplained beyond which no estimate of it is valid
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
    current, renewed = present(state), state.renewed
    if current is None or renewed is None:
        names = (f"{c}_{r}" for c, regressors in state.model.aircraft.structure.items() for r in regressors)
        return Estimates(state.transform.last, {name: _unknown(state, name) for name in names}, {})
    table = state.model.table
    grounds = renewed.grounds = renewed.grounds or _grounds(state, renewed)
    if state.model.settings.use_prior:
        _count_beliefs(state, renewed, current)
    offsets, offset_variances = _offsets(state, renewed, current)
    values = np.concatenate([current.solution.theta.ravel(), offsets]).take(table.place)
    errors = np.concatenate([current.variance.ravel(), offset_variances]).take(table.place)
    errors = np.sqrt(np.maximum(errors, 0.0))
    halves = grounds.quantiles * errors
    statuses = _judge(state, renewed, grounds, current, values, errors, now)
    columns = (values, errors, values - halves, values + halves)
    valid = [status == "ok" for status in statuses]
    rows = map(DerivativeEstimate, table.names, *(column.tolist() for column in columns), valid, statuses)
    derivatives = dict(zip(table.names, rows, strict=True))
    for name in table.unformed:
        derivatives[name] = _unknown(state, name)
    return Estimates(state.transform.last, derivatives, _fits(state, grounds, current))


def _grounds(state: State, renewed: Renewed) -> Grounds:
    """What the judgement of all estimates rests on until the next renewal."""
    table, plan, freedom = state.model.table, state.plan, renewed.uncertainty.freedom
    start, _, stop = state.model.settings.frequencies
    sound = ((freedom >= ENOUGH_FREEDOM) & ~renewed.lost)[table.coefficient]
    firm = (renewed.strength >= regression.STRONG)[table.unknown]
    spoilt = renewed.timing.spoilt[table.unknown, table.coefficient] & ~table.offset
    return Grounds(
        sound=sound & (firm | table.offset) & ~spoilt,
        spoilt=spoilt,
        quantiles=student_95(freedom)[table.coefficient],
        fits=list(
            zip(
                np.sqrt(2.0 * (stop - start) * renewed.uncertainty.density).tolist(),
                freedom.tolist(),
                [round(renewed.total.samples)] * len(plan.coefficients),
                strict=True,
            )
        ),
    )


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
    """(C,) offsets and their variances, from the signals' integrals: k C_0 = y - sum k C_j x_j at zero frequency."""
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
    return values, variance


def _fits(state: State, grounds: Grounds, current: Present) -> dict[str, FitQuality]:
    """Quality of the fit of each coefficient."""
    plan = state.plan
    explained = 1.0 - current.solution.residual / np.maximum(current.gram.take(plan.square), 1e-300)
    shares = np.minimum(np.maximum(explained, 0.0), 1.0).tolist()
    rows = zip(plan.coefficients, shares, grounds.fits, strict=True)
    return {coefficient: FitQuality(coefficient, share, *fit) for coefficient, share, fit in rows}


def _judge(
    state: State, renewed: Renewed, grounds: Grounds, current: Present, values: Array, errors: Array, now: float | None
) -> list[str]:
    """(D,) why each estimate is not to be believed, or "ok"."""
    table = state.model.table
    everywhere = _whole(state, current, now)
    if everywhere:
        return [everywhere] * len(table.names)
    motion = current.gram.take(table.motion)
    inflation = current.solution.inverse.diagonal().take(table.unknown) * motion
    good = (errors <= np.maximum(table.allowed, table.relative * np.abs(values))) & grounds.sound
    slope = ~table.offset
    buried = slope & (motion < np.maximum(BURIED * renewed.total.bias.take(table.motion), regression.TINY))
    hidden = buried | (slope & (inflation > HOPELESS))
    if hidden.any():
        # what a hidden slope does is in the offset
        hidden |= table.offset & np.isin(table.coefficient, table.coefficient[hidden])
        good &= ~hidden
    good &= ~_poor(state, current)[table.coefficient]
    if not state.thrust_known:
        good &= ~table.needs_thrust
    if good.all():
        return ["ok"] * len(table.names)
    reasons = _reasons(state, renewed, grounds, current, inflation, buried)
    return ["ok" if ok else reason for ok, reason in zip(good.tolist(), reasons, strict=True)]


def _reasons(
    state: State, renewed: Renewed, grounds: Grounds, current: Present, inflation: Array, buried: NDArray[np.bool_]
) -> list[str]:
    """(D,) what speaks against each estimate: ``inflation`` of variances, regressors ``buried`` in noise, and more."""
    table, c = state.model.table, state.model.table.coefficient
    reasons = np.full(len(table.names), "converging", dtype=object)
    # what is found later counts more
    reasons[_poor(state, current)[c]] = "outside model"
    collinear = (inflation > COLLINEAR) & ~table.offset
    if collinear.any():
        names = regression.rivals(state.plan, current.solution)
        reasons[collinear] = [f"collinear with {names[i]}" for i in table.unknown[collinear].tolist()]
    reasons[buried] = "not excited"
    reasons[grounds.spoilt] = [f"{renewed.timing.blamed[i]} not on time" for i in c[grounds.spoilt].tolist()]
    reasons[(renewed.uncertainty.freedom < ENOUGH_FREEDOM)[c]] = "converging"
    if not state.thrust_known:
        reasons[table.needs_thrust] = "thrust not measured"
    reasons[renewed.lost[c]] = "outside model"
    return reasons.tolist()


def _poor(state: State, current: Present) -> NDArray[np.bool_]:
    """(C,) whether the model leaves most of a coefficient's motion unexplained: then its interval means nothing."""
    motion = current.gram.take(state.plan.square)
    poor: NDArray[np.bool_] = (current.solution.residual > POOR * motion) & (motion > regression.TINY)
    return poor


def _whole(state: State, current: Present, now: float | None) -> str:
    """What holds of all estimates alike, if anything does."""
    last = state.transform.last
    if now is not None and now - last > STALE:
        return "stale input"
    if last - state.changed_at < SETTLING:
        return "changed"
    return "" if current.solution.usable else "not excited"
