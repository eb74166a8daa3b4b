"""Whether an estimate is to be believed, and what speaks against it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.online import reconstruction, regression
from sysid_node.online.present import Present
from sysid_node.online.regression import Plan, student_95
from sysid_node.online.state import Grounds, Renewed, State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

ENOUGH_FREEDOM = 5.0  # degrees of freedom under which an interval is not trusted
HOPELESS = 1e4  # variance inflation beyond which regressors cannot be told apart at all
COLLINEAR = 10.0  # ... beyond which collinearity is named as the reason for a wide interval
STALE = 0.5  # s without a new sample
SETTLING = 1.0  # s after an abrupt change in which "changed" is said
POOR = 0.7  # share of a coefficient's motion left unexplained beyond which no estimate of it is valid
NARROWEST = 1e-12  # share of an estimate under which its standard error is rounding
BURIED = 3.0  # times its sensor's noise energy that a regressor must move


def grounds(state: State, renewed: Renewed) -> Grounds:
    """What the judgement of all estimates rests on until the next renewal."""
    table, plan, freedom = state.model.table, state.plan, renewed.uncertainty.freedom
    c = table.coefficient
    start, _, stop = state.model.settings.frequencies
    # one weak instrument, and its whole equation is solved by least squares, which gusts bias if there are any
    firm = (np.where(plan.mine > 0.0, renewed.hold.strength[:, None], np.inf) >= regression.STRONG).all(axis=0)
    sound = ((freedom >= ENOUGH_FREEDOM) & firm & ~renewed.lost & ~renewed.doubted)[table.coefficient]
    spoilt = renewed.timing.spoilt[table.unknown, table.coefficient] & ~table.offset
    flaws = np.full(len(table.names), "", dtype=object)
    if state.flow.active:
        structure, at = state.model.aircraft.structure, state.piece_start
        flaws[:] = [reconstruction.flaw(state.flow, at, n, structure[n.partition("_")[0]]) for n in table.names]
    cautions = np.where(table.offset, renewed.prudence.max(axis=0)[c], renewed.prudence[table.unknown, c])
    caution = np.sqrt(np.maximum(cautions, 1.0))
    return Grounds(
        sound=sound & ~spoilt & (flaws == ""),
        spoilt=spoilt,
        flaws=flaws,
        squares=student_95(freedom)[c] ** 2,
        allowed=table.allowed / caution,
        relative=table.relative / caution if table.relative.any() else None,
        floor=np.maximum(BURIED * renewed.total.bias.take(plan.columns * (plan.width + 1)), regression.TINY),
        fits=list(
            zip(
                np.sqrt(2.0 * (stop - start) * renewed.uncertainty.density).tolist(),
                freedom.tolist(),
                [round(renewed.total.samples)] * len(plan.coefficients),
                strict=True,
            )
        ),
    )


def judge(
    state: State,
    renewed: Renewed,
    grounds: Grounds,
    current: Present,
    values: Array,
    errors: Array,
    nows: Sequence[float],
) -> list[tuple[str, ...]]:
    """Of K moments why each of the D estimates ``values`` (K, D) is not to be believed, or "ok"."""
    table, plan = state.model.table, state.plan
    flat = current.gram.reshape(len(values), -1)
    motion = flat.take(plan.columns * (plan.width + 1), axis=1)
    inflation = current.diagonal * motion
    buried = motion < grounds.floor
    hidden = buried | (inflation > HOPELESS)
    poor = _poor(plan, flat, current.solution.residual)
    sizes = np.abs(values)
    allowed = grounds.allowed if grounds.relative is None else np.maximum(grounds.allowed, grounds.relative * sizes)
    good = (errors <= allowed) & grounds.sound & (errors > NARROWEST * sizes)
    if hidden.any():
        good &= ~(hidden.take(table.unknown, axis=1) & ~table.offset) & ~_lost_with(state, hidden)
    if poor.any():
        good &= ~poor.take(table.coefficient, axis=1)
    if not state.thrust_known:
        good &= ~table.needs_thrust
    everywhere = [
        _whole(state, *moment) for moment in zip(current.time.tolist(), nows, current.solution.usable, strict=True)
    ]
    if good.all() and not any(everywhere):
        return [("ok",) * len(table.names)] * len(values)
    reasons = _reasons(state, renewed, grounds, current, inflation, buried, poor[:, table.coefficient])
    reasons[good] = "ok"
    return [(w,) * len(table.names) if w else tuple(r) for w, r in zip(everywhere, reasons.tolist(), strict=True)]


def _lost_with(state: State, hidden: Flags) -> Flags:
    """(K, D) offsets that hold what a hidden slope (K, P) of their coefficient does."""
    table = state.model.table
    return np.asarray(((hidden @ state.plan.mine) > 0.0)[:, table.coefficient] & table.offset)


def _reasons(
    state: State,
    renewed: Renewed,
    grounds: Grounds,
    current: Present,
    inflation: Array,
    buried: Flags,
    poor: Flags,
) -> NDArray[np.object_]:
    """(K, D) what speaks against each.

    ``inflation`` (K, P) of its unknown's variance, a regressor ``buried`` (K, P) in noise, ``poor`` (K, D), and more.
    """
    table, c = state.model.table, state.model.table.coefficient
    inflation, buried = inflation[:, table.unknown], buried[:, table.unknown] & ~table.offset
    reasons = np.full(poor.shape, "converging", dtype=object)
    # what is found later counts more
    reasons[poor] = "outside model"
    collinear = (inflation > COLLINEAR) & ~table.offset
    if collinear.any():
        rivals = regression.rivals(state.plan, current.solution)[:, table.unknown]
        names = np.array([f"collinear with {name}" for name in state.plan.regressors], dtype=object)
        reasons[collinear] = names[rivals[collinear]]
    reasons[buried] = "not excited"
    reasons[:, grounds.spoilt] = [f"{renewed.timing.blamed[i]} not on time" for i in c[grounds.spoilt].tolist()]
    reasons[:, (renewed.uncertainty.freedom < ENOUGH_FREEDOM)[c]] = "converging"
    if not state.thrust_known:
        reasons[:, table.needs_thrust] = "thrust not measured"
    reasons[:, grounds.flaws != ""] = grounds.flaws[grounds.flaws != ""]
    reasons[:, renewed.doubted[c]] = "contradicted"
    reasons[:, renewed.lost[c]] = "outside model"
    return reasons


def _poor(plan: Plan, flat: Array, residual: Array) -> Flags:
    """(K, C) whether the model leaves most of a coefficient's motion unexplained: then its interval means nothing."""
    motion = flat.take(plan.square, axis=1)
    poor: Flags = (residual > POOR * motion) & (motion > regression.TINY)
    return poor


def _whole(state: State, last: float, now: float, usable: bool) -> str:
    """What holds of all estimates of one moment alike, if anything does."""
    if now - last > STALE:
        return "stale input"
    if last - state.changed_at < SETTLING:
        return "changed"
    return "" if usable else "not excited"
