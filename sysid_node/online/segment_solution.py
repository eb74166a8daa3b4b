"""The estimates of a renewal and their covariances, from the finished segments and the present one."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.alignment import flow_angle_errors
from sysid_node.online.changes.score_test import ReferenceEstimates
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.regression import (
    actuator_lag_test,
    gust_correlation,
    least_squares,
    normal_equations,
    regressor_noise,
    weak_instruments,
)
from sysid_node.online.regression.actuator_lag_test import LagTest
from sysid_node.online.regression.information import Information
from sysid_node.online.regression.least_squares import InstrumentStrength, Solution, Uncertainty
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.regression.selection_bias import selection_bias_factors
from sysid_node.online.segment_information import finished_information, line_seconds, measure_segment
from sysid_node.online.state import (
    ControlLines,
    EstimatorState,
    FinishedSums,
    InstrumentChecks,
    LaterEstimates,
    ModelTests,
    SegmentSolution,
    Steps,
)
from sysid_node.online.systematic import estimation
from sysid_node.online.systematic.corrected_lines import LineCorrection
from sysid_node.online.systematic.corrected_signals import CorrectedSignals, corrected_signals, known_changes
from sysid_node.online.systematic.estimation import CorrectedSolution, SystematicErrors
from sysid_node.online.systematic.imperfections import line_model, remapped
from sysid_node.online.systematic.servo_model import ServoModel

Array = NDArray[np.float64]
SERVO_STEPS = 2  # changes of the servos at most in one renewal
TIMING_EVERY = 4  # pieces at least between tests for actuator lag, which changes more slowly still


def solve_with_servos(state: EstimatorState, lines: Array) -> Steps[None]:
    """Renew the estimates from the transform's ``lines``, again if the estimated servo times have notably changed."""
    imperfect = state.model.imperfections
    for changes in range(SERVO_STEPS + 1):
        found = yield from look(state, lines)
        if imperfect is None or state.controls.servos is None or found is None or changes == SERVO_STEPS:
            return
        step = estimation.notable_step(imperfect, state.controls.servos, found)
        if step is None:
            return
        yield from move_servos(state, step)


def look(state: EstimatorState, lines: Array) -> Steps[SystematicErrors | None]:
    """Renew the estimates; return the systematic errors if they are new.

    Where the signals, as the last step corrects them, fit worse than before it, a shorter step is made from there.
    """
    before = last_errors(state)
    yield from solve_all(state, measure_segment(state, lines))
    found = last_errors(state)
    if found is None or found.pieces != state.finished.pieces:
        return None
    if before is None or not estimation.worse(found, before):
        return found
    again = yield from _look_at(state, lines, before, 0.5 * before.share)
    if again is not None and not estimation.worse(found, again):
        return (yield from _look_at(state, lines, found, 1.0))
    return again


def _look_at(
    state: EstimatorState, lines: Array, place: SystematicErrors, share: float
) -> Steps[SystematicErrors | None]:
    """Renew the estimates with the signals corrected as in ``place``, and a ``share`` of the step from there."""
    if state.controls.servos is not place.lines:
        yield from move_servos(state, place.lines)
    else:
        state.changes.monitor.references.pop()
    yield from solve_all(state, measure_segment(state, lines), (place, share))
    return last_errors(state)


def last_errors(state: EstimatorState) -> SystematicErrors | None:
    """The systematic errors as they were last found."""
    return state.latest.systematic if state.latest is not None else None


def move_servos(state: EstimatorState, servos: ServoModel) -> Steps[None]:
    """Replace the controls by what these servos make of them, in all that is remembered."""
    model, imperfect, before = state.model, state.model.imperfections, state.controls.servos
    assert imperfect is not None
    assert before is not None
    states = state.controls.states
    state.controls = ControlLines(
        servos,
        None if states is None else states.moved(servos.lateness.tolist()),
        line_model(model.instrument_model, model.layout, model.spectrum.omega, servos, imperfect.applied),
    )
    first = state.segment.first_servos
    if first is not None:
        state.segment.first_servos = first.moved(servos.lateness.tolist())
        state.segment.first_impulses = state.segment.first_servos.impulses(model.spectrum.omega, first.time)
    finished, found = state.finished, {}
    kept = [info for _, info in finished.in_window]
    kept += [segment.information for excited in state.changes.excited for segment in excited.segments]
    for info in (finished.information, *kept):
        if id(info) not in found:  # blocks of equations keep the same segments
            yield
            found[id(info)] = remapped(
                info, imperfect, model.instrument_model, model.layout, model.spectrum, (before, servos)
            )
    finished.in_window = deque((end, found[id(info)]) for end, info in finished.in_window)
    finished.information = found[id(finished.information)]
    for excited in state.changes.excited:
        segments = [replace(segment, information=found[id(segment.information)]) for segment in excited.segments]
        excited.segments = deque(segments, maxlen=excited.segments.maxlen)
    state.changes.monitor.move_columns(state.transform.last)


class _SolvedEquations(NamedTuple):
    """The solution of all equations, and how far it can be trusted."""

    solution: Solution
    compensation: Array | None  # noise's part of the normal equations
    noise: Array | None  # (W, W) of which that was made, per line and second
    spread: Uncertainty
    inflation: Array  # (C,) factors of the variances by gusts
    instruments: InstrumentChecks


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
    found = _solved(state, total, gram)
    equations, spread, now = state.equations, found.spread, state.transform.last
    before = corrected = _reference(found, found.solution, spread, equations, now)
    if signals is not None:
        before = _with_recorded_signals(equations, recorded, found, now)
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
    inflation = None if corrected.inflation is None else corrected.inflation * considered.misfit
    return replace(recorded, corrected=replace(corrected, correction=correction, inflation=inflation))


def _time_errors(state: EstimatorState, systematic: SystematicErrors | None) -> Array | None:
    """(P,) standard errors of the times of the controls among the regressors, s; None where all are exact."""
    imperfect = state.model.imperfections
    if imperfect is None or systematic is None:
        return None
    timed = [state.model.layout.timed[i] for i in imperfect.timed.tolist()]
    errors = dict(zip(timed, np.hypot(systematic.errors, systematic.limits).tolist(), strict=True))
    return np.array([errors.get(name, 0.0) for name in state.equations.structure.regressors])


def _variance_factors(found: _SolvedEquations, recorded: Solution, systematic: SystematicErrors | None) -> Array:
    """(C, P) variances over those that the ``recorded`` signals' solution has by its residual alone."""
    variance = found.inflation[:, None] * found.spread.covariance.diagonal(axis1=1, axis2=2)
    if systematic is not None:
        variance = variance * systematic.considered.misfit[:, None]
    scale = recorded.residual[:, None] * np.abs(recorded.inverse.diagonal())
    return np.divide(variance, scale, out=np.zeros_like(scale), where=scale > 0.0)


def _with_recorded_signals(
    equations: NormalEquations, recorded: Information, found: _SolvedEquations, now: float
) -> ReferenceEstimates:
    """The solution with the signals as they were recorded, for estimates between renewals and short stretches."""
    solution = least_squares.solve(equations, recorded.grams.sum(axis=0), found.compensation)
    return _reference(found, solution, least_squares.uncertainty(equations, solution, recorded), equations, now)


def _reference(
    found: _SolvedEquations, solution: Solution, spread: Uncertainty, equations: NormalEquations, now: float
) -> ReferenceEstimates:
    """What later flight is tested against."""
    noise = None if found.noise is None else regressor_noise.noise_score(equations, solution, found.noise)
    return ReferenceEstimates(now, equations, solution, spread, noise, inflation=found.inflation)


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
    corrected: _SolvedEquations,
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
            correction,
            _noise_of_regressors(state, signals, corrected.noise),
        ),
        signals,
        state.finished.pieces,
        1.0 if share is None else share,
        tuple(state.search.rivals.values()),
    )
    return found


def _noise_of_regressors(state: EstimatorState, signals: CorrectedSignals, noise: Array | None) -> Array | None:
    """(W, W) Gram matrix of the regressors' ``noise``, where instruments are too weak to be used.

    Without any instruments, deflections alone would tell too little of the servos; the noise is then left in.
    """
    if noise is None or state.model.equations.least_squares:
        return None
    return line_seconds(state, signals.information) * noise


def _solve(
    state: EstimatorState, total: Information, gram: Array
) -> tuple[InstrumentStrength, Solution, Array | None, Array | None]:
    """The instruments' strength, the solution by the equations that it allows, and the noise's part in them.

    The last is the noise's Gram matrix (W, W) per line and second.
    """
    full, last = state.model.equations, state.latest
    instrument_strength = least_squares.instrument_strength(full, least_squares.solve(full, gram), total)
    equations = state.equations = normal_equations.with_strong_instruments(full, instrument_strength.strength)
    compensation, noise, amount = None, None, line_seconds(state, total)
    if last is not None and last.solution.usable:
        noise = total.bias / amount
        share = regressor_noise.allowed(equations, last.solution, last.uncertainty.density, noise)
        noise = noise * share[:, None] * share
        compensation = least_squares.bias_of(equations, amount * noise)
    solution = least_squares.solve(equations, gram, compensation)
    if compensation is not None and not solution.usable:
        solution, compensation, noise = least_squares.solve(equations, gram), None, None
    return instrument_strength, solution, compensation, noise


def _solved(state: EstimatorState, total: Information, gram: Array) -> _SolvedEquations:
    """By the equations that the instruments' strength allows, which are the state's from now on."""
    strength, solution, compensation, noise = _solve(state, total, gram)
    equations = state.equations
    spread = least_squares.uncertainty(equations, solution, total)
    noise_alone = spread.covariance
    if state.flow.active:
        spread.covariance = noise_alone + _reconstruction_covariance(state, solution, total)
    gusts = _gust_shares(state, total, equations, solution, spread)
    checks = _instrument_checks(state, total, gram, strength, solution, spread, noise_alone, gusts)
    return _SolvedEquations(solution, compensation, noise, spread, gust_correlation.inflation(spread, gusts), checks)


def _instrument_checks(
    state: EstimatorState,
    total: Information,
    gram: Array,
    strength: InstrumentStrength,
    solution: Solution,
    spread: Uncertainty,
    noise_alone: Array,
    gusts: Array,
) -> InstrumentChecks:
    """How far the instruments can be trusted; ``noise_alone`` (C, P, P) is the covariance that noise makes."""
    equations, table = state.equations, state.model.table
    mean = total.integrals[equations.columns] / max(float(total.integrals[OFFSET]), 1e-12)
    return InstrumentChecks(
        strength,
        selection_bias_factors(equations, solution, spread, strength, gram, *state.model.prior),
        weak_instruments.anderson_rubin_bounds(equations, table, solution, gram, spread, noise_alone, mean, gusts),
    )


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


def _reconstruction_covariance(state: EstimatorState, solution: Solution, total: Information) -> Array:
    """(C, P, P) covariance that errors of the aircraft file cause through reconstructed flow angles."""
    model = state.model
    return flow_angle_errors.reconstruction_covariance(
        state.flow, state.transform.last, model.aircraft, model.layout, model.spectrum, state.equations, solution, total
    )


def _gust_shares(
    state: EstimatorState, total: Information, equations: NormalEquations, solution: Solution, spread: Uncertainty
) -> Array:
    """(C,) share of the residuals that are gusts."""
    aircraft, omega = state.model.aircraft, state.model.spectrum.omega
    per_line, step = total.bias / line_seconds(state, total), total.energy / max(total.samples, 1.0)
    sensed = gust_correlation.sensed(aircraft, equations, solution, per_line, total.noise_moments, step, omega)
    return gust_correlation.share_of_gusts(spread, sensed)
