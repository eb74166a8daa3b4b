"""The update of the slowly changing quantities, after every piece of half a second of data.

With every piece the estimator tests for changes of the aircraft. It also measures the present segment and solves for
the estimates and their covariances: with every piece at first, and less often as data accumulate.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.alignment import flow_angle_errors
from sysid_node.online.changes import detection
from sysid_node.online.changes.detection import PIECE, ChangeMonitor, ChangeTests
from sysid_node.online.changes.excited_segments import no_excited_segments, remember
from sysid_node.online.changes.score_test import Reference
from sysid_node.online.frequency import sampled_transform
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.regression import (
    actuator_lag_test,
    gust_correlation,
    heteroskedasticity,
    information,
    least_squares,
    normal_equations,
    regressor_noise,
    weak_instruments,
)
from sysid_node.online.regression.actuator_lag_test import LagTest
from sysid_node.online.regression.heteroskedasticity import NoiseMoments
from sysid_node.online.regression.information import Information
from sysid_node.online.regression.least_squares import InstrumentStrength, Solution, Uncertainty
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.regression.selection_bias import selection_bias_factors
from sysid_node.online.state import EstimatorState, SegmentSolution, current_lines
from sysid_node.online.systematic import cross_spectra, estimation
from sysid_node.online.systematic.estimation import SystematicErrors
from sysid_node.online.systematic.imperfections import line_model, remapped
from sysid_node.online.systematic.servo_model import ServoModel

Array = NDArray[np.float64]
RECENT = 8  # pieces about whose mean motion is counted
SOON = 20.0  # s of data up to which everything is renewed with every piece, then with every second, third, ...
SERVO_STEPS = 2  # changes of the servos at most in one renewal
TIMING_EVERY = 4  # pieces at least between looks at the controls' timing, which changes more slowly still


def renew(state: EstimatorState, last: bool = False) -> None:
    """Renew the slowly changing quantities (``SegmentSolution``); ``last`` also finishes the segment."""
    time = state.transform.last
    lines = current_lines(state)
    _append_piece(state, lines)
    last = last or reach(time, state.step) - state.segment_start >= state.model.segment_time
    state.pieces += 1
    if last or _is_due(state):
        _measure_noise_moments(state)
        _solve_with_servos(state, lines)
    if state.model.settings.detect_changes:
        _look_for_changes(state, lines)
    if last:
        finish_segment(state)
        begin_segment(state)
    else:
        _begin_piece(state)


def reach(time: Any, step: Any) -> Any:
    """How far a sample reaches (s) with a ``step`` (s) before it: stamps of one moment jitter, the nearest counts."""
    return time + 0.5 * step


def _is_due(state: EstimatorState) -> bool:
    """Whether it is time to solve for everything again."""
    latest = state.latest
    return latest is None or state.pieces - latest.pieces >= 1 + int(latest.total.energy / SOON)


def begin_segment(state: EstimatorState) -> None:
    """Begin a segment, of which alone the transform is, and a piece of the change monitor at the last sample."""
    time = state.transform.last
    sampled_transform.restart(state.transform)
    if state.servo_states is not None:
        state.first_impulses = state.servo_states.impulses(state.model.spectrum.omega, time)
    state.segment_start, state.samples, state.intervals = time, 0, 0.0
    state.noise_moments, state.noise_measured_until = NoiseMoments(), time
    _begin_piece(state)


def _begin_piece(state: EstimatorState) -> None:
    time = state.transform.last
    state.piece = current_lines(state)
    state.piece_start, state.renew_at = time, time + PIECE


def _fading(state: EstimatorState, since: float) -> float:
    """Share of a transform's amplitude that is left of what was there at ``since`` (s)."""
    return math.exp(0.5 * state.model.spectrum.rate * (since - state.transform.last))


def _append_piece(state: EstimatorState, lines: Array) -> None:
    """Append the finished piece to the change monitor."""
    if state.transform.last > state.piece_start:
        piece = lines - state.piece * _fading(state, state.piece_start)
        state.change_monitor.pieces.append((state.piece_start, piece))


def _measure_noise_moments(state: EstimatorState) -> None:
    """Add the moments of the heteroskedastic noise since the last time that they were measured."""
    now = state.transform.last
    duration = now - state.noise_measured_until
    if duration <= 0.0 or not state.transform.recent:
        return
    pieces, every = list(state.change_monitor.pieces)[-RECENT:], state.intervals / max(state.samples, 1)
    # about the mean of the last seconds, as slower motion is not in the lines
    mean = np.sum([piece[-1] for _, piece in pieces], axis=0) / (now - pieces[0][0])
    model, rows = state.model, np.concatenate(state.transform.recent)
    boxes = max(round(2.0 * model.settings.frequencies[2] * duration), 1)
    found = heteroskedasticity.measure(
        model.aircraft, model.layout, model.equations, model.prior[0], rows, mean, duration, every, boxes
    )
    state.noise_moments = state.noise_moments + found
    state.noise_measured_until = now
    state.transform.recent.clear()


def _measure_segment(state: EstimatorState, lines: Array) -> Information:
    """The information of the present segment up to the last sample."""
    model = state.model
    begin, end = state.segment_start, state.transform.last
    info = _measured(state, lines, begin, end)
    samples = max(state.samples, 1)
    mean = info.integrals / information.window_energy(end - begin, 0.5 * model.spectrum.rate)
    per_line_second = regressor_noise.gram_bias(
        model.aircraft, model.layout, mean, (end - begin) / samples, state.intervals / samples
    )
    info.bias = _line_seconds(state, info) * per_line_second
    info.samples, info.noise_moments = float(state.samples), state.noise_moments
    state.present = info
    return info


def _measured(state: EstimatorState, lines: Array, begin: float, end: float) -> Information:
    """What the transform ``lines`` of begin..end (s) says, with its cross-spectra where not all is exact."""
    model = state.model
    edges = information.edges(model.spectrum.omega, begin, end) if model.imperfections else None
    clean = information.clean_lines(lines, state.line_model, edges)
    info = information.measure_clean(clean, lines[-1], model.spectrum, begin, end, edges)
    if model.imperfections is not None:
        info.spectra = cross_spectra.cross_spectra(clean, model.layout.transformed)
    return info


def _line_seconds(state: EstimatorState, info: Information) -> float:
    """Lines times seconds over which noise counts; the nuisances take one line."""
    return max((state.model.spectrum.omega.size - 1) * info.energy, 1e-9)


def _nothing(state: EstimatorState) -> Information:
    """No information at all."""
    return information.nothing(state.model.layout, state.past.spectra.shape[0])


def _past(state: EstimatorState) -> Information:
    """Sum of the finished segments, faded to now, without those that the window has left behind."""
    now, window = state.transform.last, state.model.settings.window
    if state.model.spectrum.rate and state.past.samples:
        state.past = state.past.scaled(math.exp(-state.model.spectrum.rate * (now - state.past_time)))
    state.past_time = now
    if window and state.window_segments and state.window_segments[0][0] <= now - window:
        state.window_segments.popleft()
        state.past = sum((info for _, info in state.window_segments), _nothing(state))
    return state.past


def _solve_with_servos(state: EstimatorState, lines: Array) -> None:
    """Renew the estimates from the transform's ``lines``; again where servos turn out to be notably elsewhere."""
    imperfect = state.model.imperfections
    for _ in range(SERVO_STEPS):
        _solve_all(state, _measure_segment(state, lines))
        latest, servos = state.latest, state.servos
        if imperfect is None or servos is None or latest is None or latest.systematic is None:
            return
        if latest.systematic.pieces != state.pieces:
            return
        step = estimation.notable_step(imperfect, servos, latest.systematic)
        if step is None:
            return
        _move_servos(state, step)
    _solve_all(state, _measure_segment(state, lines))


def _move_servos(state: EstimatorState, servos: ServoModel) -> None:
    """Take the controls to where these servos have them, in all that is remembered."""
    model, imperfect, before = state.model, state.model.imperfections, state.servos
    assert imperfect is not None
    assert before is not None
    state.servos = servos
    if state.servo_states is not None:
        state.servo_states.lateness = servos.lateness.tolist()
    state.line_model = line_model(model.instrument_model, model.layout, model.spectrum.omega, servos, imperfect.applied)

    def moved(info: Information) -> Information:
        return remapped(info, imperfect, model.instrument_model, model.layout, model.spectrum, (before, servos))

    state.past = moved(state.past)
    state.window_segments = deque((end, moved(info)) for end, info in state.window_segments)
    for excited in state.excited_segments:
        segments = [replace(segment, said=moved(segment.said)) for segment in excited.segments]
        excited.segments = deque(segments, maxlen=excited.segments.maxlen)
    # estimates by other columns are no reference for these
    state.change_monitor.references.clear()


def _solve_all(state: EstimatorState, segment: Information) -> None:
    """Renew the estimates and what is known of their errors, from the finished segments and the present one."""
    past = _past(state)
    total = past + segment
    gram = total.grams.sum(axis=0)
    instrument_strength, solution, compensation = _solve(state, total, gram)
    equations, table, now = state.equations, state.model.table, state.transform.last
    spread = least_squares.uncertainty(equations, solution, total)
    noise_alone = spread.covariance
    if state.flow.active:
        spread.covariance = noise_alone + _reconstruction_covariance(state, solution, total)
    gusts = _gust_shares(state, total, equations, solution, spread)
    scale = solution.residual[:, None] * np.abs(solution.inverse.diagonal())
    inflation = gust_correlation.inflation(spread, gusts)
    variance = inflation[:, None] * spread.covariance.diagonal(axis1=1, axis2=2)
    mean = total.integrals[equations.columns] / max(float(total.integrals[OFFSET]), 1e-12)
    none = np.zeros(len(equations.coefficients), dtype=bool)
    lag_test, timed = _lag_test(state, solution, spread, gram)
    state.latest = SegmentSolution(
        time=now,
        pieces=state.pieces,
        timed=timed,
        total=total,
        solution=solution,
        uncertainty=spread,
        compensation=compensation,
        base=past.grams.sum(axis=0),
        integrals=past.integrals,
        trim_noise=spread.bands[:, 0] * total.energy,
        factors=np.divide(variance, scale, out=np.zeros_like(scale), where=scale > 0.0),
        lag_test=lag_test,
        instrument_strength=instrument_strength,
        selection_bias_factors=selection_bias_factors(
            equations, solution, spread, instrument_strength, gram, *state.model.prior
        ),
        anderson_rubin=weak_instruments.anderson_rubin_bounds(
            equations, table, solution, gram, spread, noise_alone, mean, gusts
        ),
        outside_model=none,
        contradicted=none,
        systematic=_systematic(state, total, solution, spread, inflation),
    )
    state.change_monitor.references.append(Reference(now, equations, solution, spread))


def _systematic(
    state: EstimatorState, total: Information, solution: Solution, spread: Uncertainty, inflation: Array
) -> SystematicErrors | None:
    """What tolerances do to the estimates; None where there are none, or nothing is solved for."""
    model, servos = state.model, state.servos
    if model.imperfections is None or servos is None or not solution.usable:
        return None
    last = state.latest.systematic if state.latest is not None else None
    if last is not None and last.holds(state.pieces, servos, total.energy):
        return last
    return estimation.systematic_errors(
        model.imperfections,
        model.aircraft,
        model.layout,
        model.spectrum,
        model.instrument_model,
        servos,
        state.equations,
        solution,
        spread,
        total,
        inflation,
        state.pieces,
        last.changes if last is not None else None,
    )


def _solve(state: EstimatorState, total: Information, gram: Array) -> tuple[InstrumentStrength, Solution, Array | None]:
    """The instruments' strength, the solution by the equations that it allows, and the noise's part in them."""
    full, last = state.model.equations, state.latest
    instrument_strength = least_squares.instrument_strength(full, least_squares.solve(full, gram), total)
    equations = state.equations = normal_equations.with_strong_instruments(full, instrument_strength.strength)
    compensation = None
    if last is not None and last.solution.usable:
        share = regressor_noise.allowed(
            equations, last.solution, last.uncertainty.density, total.bias / _line_seconds(state, total)
        )
        compensation = least_squares.bias_of(equations, total.bias * share[:, None] * share)
    solution = least_squares.solve(equations, gram, compensation)
    if compensation is not None and not solution.usable:
        solution, compensation = least_squares.solve(equations, gram), None
    return instrument_strength, solution, compensation


def _lag_test(state: EstimatorState, solution: Solution, spread: Uncertainty, gram: Array) -> tuple[LagTest, int]:
    """Whether controls are felt when they are measured, looked at now and then, and with which piece it was."""
    if state.latest is None or state.pieces - state.latest.timed >= TIMING_EVERY:
        return actuator_lag_test.examine(state.equations, state.model.layout, solution, spread, gram), state.pieces
    return state.latest.lag_test, state.latest.timed


def _reconstruction_covariance(state: EstimatorState, solution: Solution, total: Information) -> Array:
    """(C, P, P) what errors of the aircraft file bring to the covariance through reconstructed flow angles."""
    model = state.model
    return flow_angle_errors.reconstruction_covariance(
        state.flow, state.transform.last, model.aircraft, model.layout, model.spectrum, state.equations, solution, total
    )


def _gust_shares(
    state: EstimatorState, total: Information, equations: NormalEquations, solution: Solution, spread: Uncertainty
) -> Array:
    """(C,) share of the residuals that are gusts."""
    aircraft, omega = state.model.aircraft, state.model.spectrum.omega
    per_line, step = total.bias / _line_seconds(state, total), total.energy / max(total.samples, 1.0)
    sensed = gust_correlation.sensed(aircraft, equations, solution, per_line, total.noise_moments, step, omega)
    return gust_correlation.share_of_gusts(spread, sensed)


def _look_for_changes(state: EstimatorState, lines: Array) -> None:
    """Begin anew where the aircraft has changed; note which coefficients the model does not explain."""
    model, now, latest = state.model, state.transform.last, state.latest
    if latest is None:
        return
    finding = detection.examine(_change_tests(state), state.excited_segments)
    unchanged = np.array_equal(finding.outside_model, latest.outside_model) and np.array_equal(
        finding.contradicted, latest.contradicted
    )
    if state.flow.active or not unchanged:
        state.latest = replace(
            latest, outside_model=finding.outside_model, contradicted=finding.contradicted, basis=None
        )
    if finding.since is not None:
        _begin_anew(state, lines, finding.since)
    if finding.changed:
        state.changed_at, state.excited_segments = now, no_excited_segments(model.equations, model.layout)


def _change_tests(state: EstimatorState) -> ChangeTests:
    """The data that the tests for changes share."""
    model = state.model
    return ChangeTests(
        model.equations,
        state.line_model,
        model.spectrum,
        state.change_monitor,
        state.transform.last,
        _memory(state),
    )


def _memory(state: EstimatorState) -> float:
    """How long ago is not forgotten, s."""
    return state.model.settings.window or state.model.memory


def _begin_anew(state: EstimatorState, lines: Array, since: float) -> None:
    """Forget all that was before ``since`` (s), the start of a piece."""
    now = state.transform.last
    _measure_noise_moments(state)
    kept = [
        piece * _fading(state, start + PIECE) for start, piece in state.change_monitor.pieces if start >= since - 1e-6
    ]
    before = lines - np.sum(kept, axis=0)
    _remember_before(state, before / _fading(state, since), since)
    # what is counted of the present segment is taken as even over its time
    share = (now - since) / (now - state.segment_start)
    state.samples, state.intervals = round(state.samples * share), state.intervals * share
    state.noise_moments = state.noise_moments * share
    state.past = _nothing(state)
    state.window_segments.clear()
    state.segment_start = since
    sampled_transform.take_out(state.transform, before)
    state.change_monitor = ChangeMonitor()
    _solve_with_servos(state, current_lines(state))


def _remember_before(state: EstimatorState, lines: Array, end: float) -> None:
    """Remember the part of the present segment until ``end`` (s), when the transform was ``lines``."""
    begin = state.segment_start
    if end - begin >= PIECE:
        remember(state.excited_segments, _measured(state, lines, begin, end), end)


def finish_segment(state: EstimatorState) -> None:
    """Put the present segment to the finished ones."""
    if state.present is not None and state.latest is not None:
        state.past = state.past + state.present
        remember(state.excited_segments, state.present, state.transform.last)
        detection.compare(state.model.equations, state.change_monitor, state.excited_segments, _memory(state))
        if state.model.settings.window:
            state.window_segments.append((state.transform.last, state.present))
        state.latest.base, state.latest.integrals = state.past.grams.sum(axis=0), state.past.integrals
    state.present = None
