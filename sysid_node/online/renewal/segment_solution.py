"""The estimates of a renewal and their covariances, from the finished segments and the present one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.changes.score_test import UNSHARED, ReferenceEstimates
from sysid_node.online.regression import (
    actuator_lag_test,
    least_squares,
    regressor_noise,
)
from sysid_node.online.regression.actuator_lag_test import LagTest
from sysid_node.online.regression.information import Information
from sysid_node.online.regression.least_squares import Solution, Uncertainty
from sysid_node.online.renewal.segment_information import finished_information, line_seconds
from sysid_node.online.renewal.solved_equations import SolvedEquations, solved_equations
from sysid_node.online.state import (
    EstimatorState,
    FinishedSums,
    LaterEstimates,
    ModelTests,
    SegmentSolution,
    Steps,
)
from sysid_node.online.systematic import estimation
from sysid_node.online.systematic.corrected_lines import LineCorrection
from sysid_node.online.systematic.corrected_signals import CorrectedSignals, corrected_signals, known_changes
from sysid_node.online.systematic.estimation import CorrectedSolution, SystematicErrors

Array = NDArray[np.float64]
TIMING_EVERY = 4  # pieces at least between tests for actuator lag, which changes more slowly still


def last_errors(state: EstimatorState) -> SystematicErrors | None:
    """The systematic errors as they were last found."""
    return state.latest.systematic if state.latest is not None else None


def solve_all(
    state: EstimatorState, segment: Information, at: tuple[SystematicErrors, float] | None = None
) -> Steps[None]:
    """Renew the estimates and their covariances, from the finished segments and the present one.

    ``at``: where the signals are to be corrected, and the share of the step that is then made; else by the last step.
    """
    yield
    past = finished_information(state)
    recorded = past + segment
    signals = yield from _corrected_signals(state, recorded, at[0].taken_out if at else None)
    yield
    total = recorded if signals is None else signals.information
    gram = total.grams.sum(axis=0)
    found = solved_equations(state, total, gram)
    spread, now = found.spread, state.transform.last
    before = corrected = _reference(state, found, found.solution, found.statistical)
    if signals is not None:
        before = _with_recorded_signals(state, recorded, found)
        yield
    systematic = yield from _systematic(state, signals, found, before.solution, at[1] if at else None)
    yield
    state.latest = SegmentSolution(
        time=now,
        pieces=state.finished.pieces,
        total=total,
        solution=before.solution,
        uncertainty=spread,
        finished=FinishedSums(past.grams.sum(axis=0), past.integrals),
        later=LaterEstimates(
            found.compensation,
            trim_noise=spread.bands[:, 0] * total.energy,
            factors=_variance_factors(found, before.solution, systematic),
        ),
        instruments=found.instruments,
        tests=_model_tests(state, found.solution, spread, gram, systematic),
        gusts=found.gusts,
        systematic=systematic,
    )
    off = None if systematic is None else systematic.covariance
    before, corrected = (replace(one, systematic=off) for one in (before, corrected))
    before = replace(before, time_errors=_time_errors(state, systematic))
    state.changes.monitor.add_reference(_with_corrected(state, before, corrected, signals, systematic))


def _with_corrected(
    state: EstimatorState,
    recorded: ReferenceEstimates,
    corrected: ReferenceEstimates,
    signals: CorrectedSignals | None,
    systematic: SystematicErrors | None,
) -> ReferenceEstimates:
    """The estimates by ``recorded`` signals, and with them those by ``corrected`` ones, where there are such."""
    imperfect, servos = state.model.imperfections, state.controls.servos
    if imperfect is None or servos is None or signals is None or systematic is None:
        return recorded
    considered = systematic.considered
    correction = LineCorrection(
        imperfect, signals.changes, servos, signals.estimate, considered.covariance, considered.jacobian[:, :, :-1]
    )
    inflation = None if corrected.inflation is None else corrected.inflation * considered.overdispersion
    return replace(recorded, corrected=replace(corrected, correction=correction, inflation=inflation))


def _time_errors(state: EstimatorState, systematic: SystematicErrors | None) -> Array | None:
    """(P,) standard errors of the times of the controls among the regressors, s; None where all are exact."""
    imperfect = state.model.imperfections
    if imperfect is None or systematic is None:
        return None
    timed = [state.model.layout.timed[i] for i in imperfect.timed.tolist()]
    errors = dict(zip(timed, np.hypot(systematic.errors, systematic.limits).tolist(), strict=True))
    return np.array([errors.get(name, 0.0) for name in state.equations.structure.regressors])


def _variance_factors(found: SolvedEquations, recorded: Solution, systematic: SystematicErrors | None) -> Array:
    """(C, P) variances over those that the ``recorded`` signals' solution has by its residual alone."""
    factors = found.inflation if systematic is None else found.inflation * systematic.considered.overdispersion
    # both tell that the errors are larger than the residuals say, and may tell of the same cause: the larger counts
    factors = np.maximum(factors, found.scatter)
    variance = factors[:, None] * found.spread.covariance.diagonal(axis1=1, axis2=2)
    scale = recorded.residual[:, None] * np.abs(recorded.inverse.diagonal())
    return np.divide(variance, scale, out=np.zeros_like(scale), where=scale > 0.0)


def _with_recorded_signals(state: EstimatorState, recorded: Information, found: SolvedEquations) -> ReferenceEstimates:
    """The solution with the signals as they were recorded, for estimates between renewals and short stretches."""
    equations = state.equations
    solution = least_squares.solve(equations, recorded.grams.sum(axis=0), found.compensation)
    return _reference(state, found, solution, least_squares.uncertainty(equations, solution, recorded))


def _reference(
    state: EstimatorState, found: SolvedEquations, solution: Solution, spread: Uncertainty
) -> ReferenceEstimates:
    """What later flight is tested against."""
    equations, now = state.equations, state.transform.last
    noise = None if found.noise is None else regressor_noise.noise_score(equations, solution, found.noise)
    model = state.controls.line_model
    inflation = 1.0 + UNSHARED**2 * (found.inflation - 1.0)
    return ReferenceEstimates(now, equations, solution, spread, model, noise, inflation=inflation, sensed=found.sensed)


def _corrected_signals(
    state: EstimatorState, recorded: Information, taken_out: Array | None
) -> Steps[CorrectedSignals | None]:
    """The signals without what is so far estimated of the imperfections, or is to be taken out; None where none are."""
    model, servos = state.model, state.controls.servos
    if model.imperfections is None or servos is None:
        return None
    last = last_errors(state)
    if taken_out is None:
        taken_out = estimation.to_take_out(model.imperfections, servos, last)
    known = known_changes(model.imperfections, model.aircraft, model.layout, recorded, last.known if last else None)
    if last is None or known is not last.known:
        yield
    found = yield from corrected_signals(
        model.imperfections,
        model.spectrum,
        model.instrument_model,
        servos,
        recorded,
        taken_out,
        known,
    )
    return found


def _systematic(
    state: EstimatorState,
    signals: CorrectedSignals | None,
    corrected: SolvedEquations,
    recorded: Solution,
    share: float | None,
) -> Steps[SystematicErrors | None]:
    """The effect of the tolerances on the estimates; None where there are none, or nothing is solved for.

    With a ``share`` of a step they are looked at anew, else when it is time.
    """
    imperfect, servos, equations = state.model.imperfections, state.controls.servos, state.equations
    if imperfect is None or servos is None or signals is None or not corrected.solution.usable:
        return None
    correction = signals.correction(equations, corrected.solution, recorded)
    last = last_errors(state)
    if share is None and last is not None and last.holds(state.finished.pieces, servos, signals.information.energy):
        return replace(last, correction=correction)
    limits = state.rate_limited
    found = yield from estimation.systematic_errors(
        imperfect if limits is None else imperfect.limited(limits.errors()[imperfect.timed]),
        servos,
        CorrectedSolution(
            equations,
            corrected.solution,
            corrected.spread,
            corrected.inflation,
            corrected.gusts,
            correction,
            _noise_of_regressors(state, signals, corrected.noise),
        ),
        signals,
        state.finished.pieces,
        1.0 if share is None else share,
        tuple(state.search.alternatives.values()),
    )
    return found


def _noise_of_regressors(state: EstimatorState, signals: CorrectedSignals, noise: Array | None) -> Array | None:
    """(W, W) Gram matrix of the regressors' ``noise``, where instruments are too weak to be used.

    Without any instruments, deflections alone would tell too little of the servos; the noise is then left in.
    """
    if noise is None or state.model.equations.least_squares:
        return None
    return line_seconds(state, signals.information) * noise


def _model_tests(
    state: EstimatorState, solution: Solution, spread: Uncertainty, gram: Array, systematic: SystematicErrors | None
) -> ModelTests:
    """The test for actuator lag; those for changes come later, with the renewal's watch for them."""
    none = np.zeros(len(state.equations.structure.coefficients), dtype=bool)
    return ModelTests(*_lag_test(state, solution, spread, gram, systematic), none, none)


def _lag_test(
    state: EstimatorState, solution: Solution, spread: Uncertainty, gram: Array, systematic: SystematicErrors | None
) -> tuple[LagTest, int]:
    """The test for actuator lag, carried out every few pieces, and the number of pieces when it was."""
    latest, pieces = state.latest, state.finished.pieces
    if latest is not None and pieces - latest.tests.lag_tested < TIMING_EVERY:
        return latest.tests.lag, latest.tests.lag_tested
    variance = None if systematic is None else np.maximum(systematic.variance[:, :-1], 0.0)
    return actuator_lag_test.examine(state.equations, state.model.layout, solution, spread, gram, variance), pieces
