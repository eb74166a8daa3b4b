"""What follows from the tests for changes: the estimator begins anew where the aircraft has changed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.changes import detection
from sysid_node.online.changes.detection import PIECE, ChangeDecision, ChangeMonitor, ChangeTests
from sysid_node.online.changes.excited_segments import no_excited_segments, remember
from sysid_node.online.frequency import sampled_transform
from sysid_node.online.renewal.segment_information import fading, information_of, measure_noise_moments, no_information
from sysid_node.online.renewal.servo_steps import solve_with_servos
from sysid_node.online.state import EstimatorState, Steps, current_lines

Array = NDArray[np.float64]


def look_for_changes(state: EstimatorState) -> ChangeDecision | None:
    """What the last pieces say, up to the one that has just ended; None where changes are not looked for."""
    if not state.model.settings.detect_changes:
        return None
    return detection.examine(_change_tests(state), state.changes.excited)


def residuals_of_earlier_flight(state: EstimatorState, finding: ChangeDecision) -> Array | None:
    """Residuals of the flight from before a change of the aircraft (2, C); None where no change is found."""
    if not finding.changed or finding.since is None:
        return None
    return detection.residuals_of_earlier_flight(_change_tests(state), state.changes.excited, finding.since)


def respond(state: EstimatorState, lines: Array, finding: ChangeDecision) -> Steps[None]:
    """Begin anew where the aircraft has changed; note which coefficients the model does not explain."""
    model, now, latest = state.model, state.transform.last, state.latest
    if latest is None:
        return
    tests = replace(latest.tests, outside_model=finding.outside_model, contradicted=finding.contradicted)
    unchanged = np.array_equal(tests.outside_model, latest.tests.outside_model) and np.array_equal(
        tests.contradicted, latest.tests.contradicted
    )
    if state.flow.active or not unchanged:
        state.latest = replace(latest, tests=tests, basis=None, published=None)
    if finding.since is not None:
        yield from _begin_anew(state, lines, finding.since)
    if finding.changed:
        state.changes.changed_at, state.changes.excited = now, no_excited_segments(model.equations, model.layout)


def _change_tests(state: EstimatorState) -> ChangeTests:
    """The data that the tests for changes share."""
    model = state.model
    return ChangeTests(
        model.equations,
        state.controls.line_model,
        model.spectrum,
        state.changes.monitor,
        state.transform.last,
        memory(state),
    )


def memory(state: EstimatorState) -> float:
    """How long ago is not forgotten, s."""
    return state.model.settings.window or state.model.times.memory


def _begin_anew(state: EstimatorState, lines: Array, since: float) -> Steps[None]:
    """Forget all that was before ``since`` (s), the start of a piece."""
    now, segment, pieces = state.transform.last, state.segment, state.changes.monitor.pieces
    measure_noise_moments(state)
    kept = [piece * fading(state, start + PIECE) for start, piece in pieces if start >= since - 1e-6]
    before = lines - np.sum(kept, axis=0)
    _remember_before(state, before / fading(state, since), since)
    # samples and noise of the present segment are assumed even over its time
    share = (now - since) / (now - segment.start)
    segment.samples, segment.intervals = round(segment.samples * share), segment.intervals * share
    segment.noise_moments = segment.noise_moments * share
    state.finished.information = no_information(state)
    state.finished.in_window.clear()
    faded = math.exp(0.5 * state.model.spectrum.rate * (segment.start - since))  # they count from the new start
    segment.first_impulses = segment.first_impulses * faded
    segment.start_at(since, state.model.spectrum.omega)
    segment.first_servos = None  # what was before is taken out with the servos as they were
    sampled_transform.take_out(state.transform, before)
    state.changes.monitor = ChangeMonitor()
    yield from solve_with_servos(state, current_lines(state))


def _remember_before(state: EstimatorState, lines: Array, end: float) -> None:
    """Remember the part of the present segment until ``end`` (s), when the transform was ``lines``."""
    begin = state.segment.start
    if end - begin >= PIECE:
        remember(state.changes.excited, information_of(state, lines, begin, end), end)
