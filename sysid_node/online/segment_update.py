"""What the estimator does with every piece of data, half a second: look for changes.

And with every piece at first, the more seldom the more is known: measure the segment, and renew what all estimates rest
on.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.alignment import flow_angle_filter
from sysid_node.online.changes import detection
from sysid_node.online.changes.detection import PIECE, ChangeMonitor, ChangeTests
from sysid_node.online.changes.excited_segments import no_excited_segments, remember
from sysid_node.online.changes.score_test import Reference
from sysid_node.online.frequency import sampled_transform
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.regression import (
    actuator_lag_test as timing,
)
from sysid_node.online.regression import (
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
from sysid_node.online.state import EstimatorState, SegmentSolution

Array = NDArray[np.float64]
RECENT = 8  # pieces about whose mean motion is counted
SOON = 20.0  # s of data up to which everything is renewed with every piece, then with every second, third, ...
TIMING_EVERY = 4  # pieces at least between looks at the controls' timing, which changes more slowly still


def renew(state: EstimatorState, last: bool = False) -> None:
    """Renew what changes slowly, see ``Renewed``; all of it where this is the ``last`` time in the segment."""
    time = state.transform.last
    lines = sampled_transform.current(state.transform)
    _watch_piece(state, lines)
    last = last or reach(time, state.step) - state.segment_start >= state.model.segment_time
    state.pieces += 1
    if last or _is_due(state):
        _weigh_recent(state)
        _solve_all(state, _measure_segment(state, lines))
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
    renewed = state.renewed
    return renewed is None or state.pieces - renewed.pieces >= 1 + int(renewed.total.energy / SOON)


def begin_segment(state: EstimatorState) -> None:
    """Begin a segment, of which alone the transform is, and a piece of the watch at the last sample."""
    time = state.transform.last
    sampled_transform.restart(state.transform)
    state.segment_start, state.samples, state.intervals = time, 0, 0.0
    state.uneven, state.weighed_until = NoiseMoments(), time
    _begin_piece(state)


def _begin_piece(state: EstimatorState) -> None:
    time = state.transform.last
    state.piece, state.piece_start, state.renew_at = sampled_transform.current(state.transform), time, time + PIECE


def _fading(state: EstimatorState, since: float) -> float:
    """Share of a transform's amplitude that is left of what was there at ``since`` (s)."""
    return math.exp(0.5 * state.model.spectrum.rate * (since - state.transform.last))


def _watch_piece(state: EstimatorState, lines: Array) -> None:
    """Hand the finished piece to the watch."""
    if state.transform.last > state.piece_start:
        piece = lines - state.piece * _fading(state, state.piece_start)
        state.watch.pieces.append((state.piece_start, piece))


def _weigh_recent(state: EstimatorState) -> None:
    """Count how unevenly the noise came since this was last counted."""
    now = state.transform.last
    duration = now - state.weighed_until
    if duration <= 0.0 or not state.transform.recent:
        return
    pieces, every = list(state.watch.pieces)[-RECENT:], state.intervals / max(state.samples, 1)
    # about the mean of the last seconds, as slower motion is not in the lines
    mean = np.sum([piece[-1] for _, piece in pieces], axis=0) / (now - pieces[0][0])
    model, rows = state.model, np.concatenate(state.transform.recent)
    boxes = max(round(2.0 * model.settings.frequencies[2] * duration), 1)
    found = heteroskedasticity.measure(
        model.aircraft, model.layout, model.plan, model.believed[0], rows, mean, duration, every, boxes
    )
    state.uneven = state.uneven + found
    state.weighed_until = now
    state.transform.recent.clear()


def _measure_segment(state: EstimatorState, lines: Array) -> Information:
    """What the present segment says up to now."""
    model = state.model
    begin, end = state.segment_start, state.transform.last
    info = information.measure(lines, model.auxiliary, model.spectrum, begin, end)
    samples = max(state.samples, 1)
    mean = info.integrals / information.window_energy(end - begin, 0.5 * model.spectrum.rate)
    per_line_second = regressor_noise.gram_bias(
        model.aircraft, model.layout, mean, (end - begin) / samples, state.intervals / samples
    )
    info.bias = _line_seconds(state, info) * per_line_second
    info.samples, info.uneven = float(state.samples), state.uneven
    state.present = info
    return info


def _line_seconds(state: EstimatorState, info: Information) -> float:
    """Lines times seconds over which noise counts; the nuisances take one line."""
    return max((state.model.spectrum.omega.size - 1) * info.energy, 1e-9)


def _past(state: EstimatorState) -> Information:
    """Sum of the finished segments, faded to now, without those that the window has left behind."""
    now, window = state.transform.last, state.model.settings.window
    if state.model.spectrum.rate and state.past.samples:
        state.past = state.past.scaled(math.exp(-state.model.spectrum.rate * (now - state.past_time)))
    state.past_time = now
    if window and state.inside and state.inside[0][0] <= now - window:
        state.inside.popleft()
        state.past = sum((info for _, info in state.inside), information.nothing(state.model.layout))
    return state.past


def _solve_all(state: EstimatorState, segment: Information) -> None:
    """Renew the estimates and what is known of their errors, from the finished segments and the present one."""
    past = _past(state)
    total = past + segment
    gram = total.grams.sum(axis=0)
    hold, solution, compensation = _solve(state, total, gram)
    plan, table, now = state.plan, state.model.table, state.transform.last
    spread = least_squares.uncertainty(plan, solution, total)
    noise_alone = spread.covariance
    if state.flow.active:
        spread.covariance = noise_alone + _doubt(state, solution, total)
    gusts = _gusts(state, total, plan, solution, spread)
    scale = solution.residual[:, None] * np.abs(solution.inverse.diagonal())
    variance = gust_correlation.inflation(spread, gusts)[:, None] * spread.covariance.diagonal(axis1=1, axis2=2)
    mean = total.integrals[plan.columns] / max(float(total.integrals[OFFSET]), 1e-12)
    none = np.zeros(len(plan.coefficients), dtype=bool)
    timing, timed = _timing(state, solution, spread, gram)
    state.renewed = SegmentSolution(
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
        timing=timing,
        hold=hold,
        prudence=selection_bias_factors(plan, solution, spread, hold, gram, *state.model.believed),
        bend=weak_instruments.anderson_rubin_bounds(plan, table, solution, gram, spread, noise_alone, mean, gusts),
        lost=none,
        doubted=none,
    )
    state.watch.references.append(Reference(now, plan, solution, spread))


def _solve(state: EstimatorState, total: Information, gram: Array) -> tuple[InstrumentStrength, Solution, Array | None]:
    """The instruments' hold, the solution by the plan that it allows, and the noise's part in the equations."""
    full, last = state.model.plan, state.renewed
    hold = least_squares.instrument_strength(full, least_squares.solve(full, gram), total)
    plan = state.plan = normal_equations.with_strong_instruments(full, hold.strength)
    compensation = None
    if last is not None and last.solution.usable:
        share = regressor_noise.allowed(
            plan, last.solution, last.uncertainty.density, total.bias / _line_seconds(state, total)
        )
        compensation = least_squares.bias_of(plan, total.bias * share[:, None] * share)
    solution = least_squares.solve(plan, gram, compensation)
    if compensation is not None and not solution.usable:
        solution, compensation = least_squares.solve(plan, gram), None
    return hold, solution, compensation


def _timing(state: EstimatorState, solution: Solution, spread: Uncertainty, gram: Array) -> tuple[LagTest, int]:
    """Whether controls are felt when they are measured, looked at now and then, and with which piece it was."""
    if state.renewed is None or state.pieces - state.renewed.timed >= TIMING_EVERY:
        return timing.examine(state.plan, state.model.layout, solution, spread, gram), state.pieces
    return state.renewed.timing, state.renewed.timed


def _doubt(state: EstimatorState, solution: Solution, total: Information) -> Array:
    """(C, P, P) what errors of the aircraft file bring to the covariance through reconstructed flow angles."""
    model = state.model
    return flow_angle_filter.doubt(
        state.flow, state.transform.last, model.aircraft, model.layout, model.spectrum, state.plan, solution, total
    )


def _gusts(
    state: EstimatorState, total: Information, plan: NormalEquations, solution: Solution, spread: Uncertainty
) -> Array:
    """(C,) share of the residuals that are gusts."""
    aircraft, omega = state.model.aircraft, state.model.spectrum.omega
    per_line, step = total.bias / _line_seconds(state, total), total.energy / max(total.samples, 1.0)
    sensed = gust_correlation.sensed(aircraft, plan, solution, per_line, total.uneven, step, omega)
    return gust_correlation.share_of_gusts(spread, sensed)


def _look_for_changes(state: EstimatorState, lines: Array) -> None:
    """Begin anew where the aircraft has changed; note which coefficients the model does not explain."""
    model, now, renewed = state.model, state.transform.last, state.renewed
    if renewed is None:
        return
    finding = detection.examine(_looking(state), state.experiences)
    same = np.array_equal(finding.lost, renewed.lost) and np.array_equal(finding.doubted, renewed.doubted)
    if state.flow.active or not same:
        state.renewed = replace(renewed, lost=finding.lost, doubted=finding.doubted, grounds=None)
    if finding.since is not None:
        _begin_anew(state, lines, finding.since)
    if finding.changed:
        state.changed_at, state.experiences = now, no_excited_segments(model.plan, model.layout)


def _looking(state: EstimatorState) -> ChangeTests:
    """What looks for changes share."""
    model = state.model
    return ChangeTests(model.plan, model.auxiliary, model.spectrum, state.watch, state.transform.last, _memory(state))


def _memory(state: EstimatorState) -> float:
    """How long ago is not forgotten, s."""
    return state.model.settings.window or state.model.memory


def _begin_anew(state: EstimatorState, lines: Array, since: float) -> None:
    """Forget all that was before ``since`` (s), the start of a piece."""
    now = state.transform.last
    _weigh_recent(state)
    kept = [piece * _fading(state, start + PIECE) for start, piece in state.watch.pieces if start >= since - 1e-6]
    before = lines - np.sum(kept, axis=0)
    _learn_before(state, before / _fading(state, since), since)
    # what is counted of the present segment is taken as even over its time
    share = (now - since) / (now - state.segment_start)
    state.samples, state.intervals = round(state.samples * share), state.intervals * share
    state.uneven = state.uneven * share
    state.past = information.nothing(state.model.layout)
    state.inside.clear()
    state.segment_start = since
    sampled_transform.take_out(state.transform, before)
    state.watch = ChangeMonitor()
    _solve_all(state, _measure_segment(state, sampled_transform.current(state.transform)))


def _learn_before(state: EstimatorState, lines: Array, end: float) -> None:
    """Remember the part of the present segment until ``end`` (s), when the transform was ``lines``."""
    begin, model = state.segment_start, state.model
    if end - begin < PIECE:
        return
    remember(state.experiences, information.measure(lines, model.auxiliary, model.spectrum, begin, end), end)


def finish_segment(state: EstimatorState) -> None:
    """Put the present segment to the finished ones."""
    if state.present is not None and state.renewed is not None:
        state.past = state.past + state.present
        remember(state.experiences, state.present, state.transform.last)
        detection.compare(state.model.plan, state.watch, state.experiences, _memory(state))
        if state.model.settings.window:
            state.inside.append((state.transform.last, state.present))
        state.renewed.base, state.renewed.integrals = state.past.grams.sum(axis=0), state.past.integrals
    state.present = None
