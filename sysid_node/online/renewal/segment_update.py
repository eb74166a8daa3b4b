"""The update of the slowly changing quantities, after every piece of half a second of data.

With every piece the estimator tests for changes of the aircraft. It also measures the present segment and solves for
the estimates and their covariances: with every piece at first, and less often as data accumulate. That takes long, so
it is done in steps, with the samples that follow (``pending_renewal``).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.changes import detection
from sysid_node.online.changes.detection import PIECE, ChangeDecision, ChangeMonitor
from sysid_node.online.changes.excited_segments import remember
from sysid_node.online.frequency import sampled_transform
from sysid_node.online.frequency.fourier_transform import impulse
from sysid_node.online.regression.heteroskedasticity import NoiseMoments
from sysid_node.online.regression.information import edges, products
from sysid_node.online.renewal import pending_renewal, servo_search
from sysid_node.online.renewal.change_response import look_for_changes, memory, residuals_of_earlier_flight, respond
from sysid_node.online.renewal.segment_information import fading, measure_noise_moments
from sysid_node.online.renewal.servo_steps import solve_with_servos
from sysid_node.online.state import EstimatorState, FinishedSums, Steps, completed, current_lines

Array = NDArray[np.float64]
SOON = 20.0  # s of data up to which everything is renewed with every piece, then with every second, third, ...


def renew(state: EstimatorState, last: bool = False) -> None:
    """Begin to renew the slowly changing quantities (``SegmentSolution``); ``last`` also finishes the segment."""
    pending_renewal.complete(state)
    time = state.transform.last
    lines = current_lines(state)
    _append_piece(state, lines)
    last = last or reach(time, state.inputs.step) - state.segment.start >= state.model.times.length
    state.finished.pieces += 1
    before = state.changes.monitor.before_examination()
    finding = look_for_changes(state)
    if last or _is_due(state):
        measure_noise_moments(state)
        pending_renewal.begin(state, last, lambda copy: _solved(copy, lines, last, finding, before))
    elif finding is not None:
        completed(respond(state, lines, finding))
    if last:
        _count_segment_in(state, lines)
        begin_segment(state)
    else:
        _begin_piece(state)
    if finding is not None and finding.since is not None:
        pending_renewal.complete(state)  # nobody shall wait for the news that the aircraft has changed


def _solved(
    state: EstimatorState, lines: Array, last: bool, finding: ChangeDecision | None, before: ChangeMonitor
) -> Steps[None]:
    """Solve for everything again, respond to changes, and finish the segment if this is its ``last`` renewal.

    Where servos were moved, what seemed a change can be the servos' time. The last pieces are then examined again, by
    the change monitor as it was ``before`` the ``finding``; but not where earlier flight, too, contradicts these
    servos: then it was the change that moved them.
    """
    servos = state.controls.servos
    residuals = None if finding is None or servos is None else residuals_of_earlier_flight(state, finding)
    yield from solve_with_servos(state, lines)
    yield from servo_search.try_another_solution(state)
    if finding is not None and state.controls.servos is not servos:
        yield
        if residuals is None or not _contradicts_servos(state, finding, residuals):
            state.changes.monitor = before
            finding = look_for_changes(state)
    if finding is not None:
        yield from respond(state, lines, finding)
    if last:
        finish_segment(state)


def _contradicts_servos(state: EstimatorState, finding: ChangeDecision, before: Array) -> bool:
    """Whether flight from before the change contradicts the servos; ``before``: its residuals with the former ones."""
    residuals, servos = residuals_of_earlier_flight(state, finding), state.controls.servos
    if residuals is None or servos is None:
        return False
    unknowns = 3 * servos.lateness.size  # lateness, curvature and third coefficient of each
    return detection.fits_worse(residuals, before, unknowns)


def reach(time: Any, step: Any) -> Any:
    """How far a sample reaches (s) with a ``step`` (s) before it: stamps of one moment jitter, the nearest counts."""
    return time + 0.5 * step


def _is_due(state: EstimatorState) -> bool:
    """Whether it is time to solve for everything again."""
    latest = state.latest
    return latest is None or state.finished.pieces - latest.pieces >= 1 + int(latest.total.energy / SOON)


def _count_segment_in(state: EstimatorState, lines: Array) -> None:
    """Let estimates hold the segment that ends here until its last renewal is done."""
    latest, model = state.latest, state.model
    if latest is not None:
        end = impulse(model.spectrum.omega, state.transform.last)
        impulses = edges(state.segment.start_impulse, end) if state.controls.servos else None
        gram = latest.finished.gram + products(lines.copy(), state.controls.line_model, impulses)
        latest.finished = FinishedSums(gram, latest.finished.integrals + lines[-1])


def begin_segment(state: EstimatorState) -> None:
    """Begin a segment, of which alone the transform is, and a piece of the change monitor at the last sample."""
    time, segment = state.transform.last, state.segment
    sampled_transform.restart(state.transform)
    segment.start_at(time, state.model.spectrum.omega)
    if state.controls.states is not None:
        segment.first_servos = state.controls.states.copy()
        segment.first_impulses = segment.first_servos.impulses(segment.start_impulse)
    segment.samples, segment.intervals = 0, 0.0
    segment.noise_moments, segment.noise_measured_until = NoiseMoments(), time
    _begin_piece(state)


def _begin_piece(state: EstimatorState) -> None:
    """Begin a piece of the change monitor at the last sample."""
    time = state.transform.last
    state.segment.piece_lines = current_lines(state)
    state.segment.piece_start, state.segment.renew_at = time, time + PIECE


def _append_piece(state: EstimatorState, lines: Array) -> None:
    """Append the finished piece to the change monitor."""
    if state.transform.last > state.segment.piece_start:
        piece = lines - state.segment.piece_lines * fading(state, state.segment.piece_start)
        state.changes.monitor.pieces.append((state.segment.piece_start, piece))


def finish_segment(state: EstimatorState) -> None:
    """Add the present segment to the finished ones."""
    present, latest, finished = state.segment.information, state.latest, state.finished
    if present is not None and latest is not None:
        finished.information = finished.information + present
        remember(state.changes.excited, present, state.transform.last)
        detection.compare(state.model.equations, state.changes.monitor, state.changes.excited, memory(state))
        if state.model.settings.window:
            finished.in_window.append((state.transform.last, present))
        latest.finished = FinishedSums(finished.information.grams.sum(axis=0), finished.information.integrals)
    state.segment.information = None
