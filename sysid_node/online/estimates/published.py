"""From the estimator's state to what is published: values, 95 % intervals, and whether to believe them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sysid_node.online import status
from sysid_node.online.estimates.current_solution import CurrentSolution, current_solution
from sysid_node.online.estimates.rows import DerivativeRows, FitRows
from sysid_node.online.estimates.validity import NORMAL_95, judge, validity_basis
from sysid_node.online.frequency import regression_signals
from sysid_node.online.regression import weak_instruments
from sysid_node.online.state import EstimatorState, PublishedImperfections, SegmentSolution
from sysid_node.online.systematic.budget import Budget
from sysid_node.online.systematic.estimation import with_steps
from sysid_node.online.types import DerivativeEstimate, Estimates

Array = NDArray[np.float64]

AHEAD = "ahead of its command"  # status of a servo that no surface can have
SERVO_KNOWN = 0.01  # s: the largest standard error of a servo's time that is valid


def estimate(state: EstimatorState, now: float | None = None) -> Estimates:
    """All derivatives of the aircraft's model with their intervals; ``now`` (s) tells how old the last sample is."""
    return estimate_of(state, current_solution(state), now)


def estimate_of(state: EstimatorState, current: CurrentSolution | None, now: float | None = None) -> Estimates:
    """The same from what was just solved for."""
    time, latest = state.transform.last, state.latest
    if current is None or latest is None:
        return Estimates(time, _nothing_known(state), {})
    codes = judge(state, latest, current, time if now is None else now)
    model = state.model
    numbers = _intervals(state, latest, current)
    missing = len(model.table.unformed)
    if missing:
        nothing = [math.nan, math.inf, math.inf, 0.0, -math.inf, math.inf]
        numbers = np.concatenate([numbers, np.tile(nothing, (missing, 1))])
        codes = np.concatenate([codes, np.full(missing, status.INERTIA, codes.dtype)])
    derivatives = DerivativeRows(model.table.all_names, numbers, codes, model.vocabulary)
    fits = FitRows(model.equations.structure.coefficients, _fits(state, latest, current))
    if latest.systematic is None:
        return Estimates(time, derivatives, fits)
    if latest.published is None:
        latest.published = PublishedImperfections(_servos(state, latest), _budget(state, latest))
    published = latest.published
    return Estimates(time, derivatives, fits, published.servos, published.budget.with_variances(current.variances))


def _servos(state: EstimatorState, latest: SegmentSolution) -> dict[str, DerivativeEstimate]:
    """How late each control follows what is recorded of it, s: of those whose servos are not exactly known."""
    imperfect, found = state.model.imperfections, latest.systematic
    assert imperfect is not None
    assert found is not None
    late, ahead, rows = found.servos.lateness[imperfect.timed].tolist(), found.ahead(imperfect).tolist(), {}
    objections = state.model.vocabulary.texts(validity_basis(state, latest).servos)
    # These delays concern the derivatives as much as the servo's own, and the flight cannot tell them from it.
    apart = imperfect.step_time**2 + imperfect.held_or_not**2 + found.limits**2
    errors = np.sqrt(found.errors**2 + apart).tolist()
    parts = zip(imperfect.controls, late, errors, ahead, objections, strict=True)
    for name, value, error, early, objection in parts:
        known = "ok" if error <= SERVO_KNOWN else "converging"
        half, words = NORMAL_95 * error, AHEAD if early else objection if objection != "ok" else known
        valid = words == "ok"
        rows[name] = DerivativeEstimate(name, value, error, value - half, value + half, valid, words, error, 0.0)
    return rows


def _budget(state: EstimatorState, latest: SegmentSolution) -> Budget:
    """What the variance of each derivative is made of, but for its statistical part."""
    imperfect, found, table = state.model.imperfections, latest.systematic, state.model.table
    assert imperfect is not None
    assert found is not None
    jacobian = found.considered.jacobian
    per_derivative = jacobian.reshape(jacobian.shape[0], -1)[:, table.place]
    covariance = with_steps(imperfect, found.considered).covariance
    return Budget(table.names, imperfect.keys, per_derivative, covariance, np.zeros(len(table.names)))


def _intervals(state: EstimatorState, latest: SegmentSolution, current: CurrentSolution) -> Array:
    """(D, 6) of each derivative: value, standard error, its statistical and systematic part, ends of the interval."""
    values, variances, basis = current.values, current.variances, validity_basis(state, latest)
    below, above = weak_instruments.interval_arms(basis.squares * variances, latest.instruments.anderson_rubin)
    statistical = np.sqrt(variances)
    errors = statistical
    if latest.systematic is not None:
        errors, arms = np.sqrt(variances + basis.systematic), basis.systematic_arms
        below, above = np.sqrt(below * below + arms), np.sqrt(above * above + arms)
    return np.array([values, errors, statistical, basis.systematic_errors, values - below, values + above]).T


def _fits(state: EstimatorState, latest: SegmentSolution, current: CurrentSolution) -> Array:
    """(C, 4) numbers of the fits, see ``rows``."""
    solution, fits = current.solution, validity_basis(state, latest).fits.copy()
    explained = 1.0 - solution.residual / np.maximum(solution.motion, 1e-300)
    np.minimum(np.maximum(explained, 0.0), 1.0, out=fits[:, 0])
    return fits


def _nothing_known(state: EstimatorState) -> dict[str, DerivativeEstimate]:
    """All derivatives before there is anything to solve."""
    every = (f"{c}_{r}" for c, regressors in state.model.aircraft.model_structure.items() for r in regressors)
    return {name: _unknown(state, name) for name in every}


def _unknown(state: EstimatorState, name: str) -> DerivativeEstimate:
    """A derivative of which nothing is known, and why."""
    reason = regression_signals.unformed(state.model.aircraft).get(name.partition("_")[0])
    if reason is None and state.inputs.incomplete and state.segment.samples == 0:
        column = max(state.inputs.incomplete, key=lambda column: state.inputs.incomplete[column])
        reason = f"{column} not measured"
    return DerivativeEstimate(name, math.nan, math.inf, -math.inf, math.inf, False, reason or "converging")
