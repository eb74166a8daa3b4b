"""Renewals of the estimates, again where the servos' times that are estimated with them have notably changed."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency.fourier_transform import impulse
from sysid_node.online.renewal.segment_information import measure_segment
from sysid_node.online.renewal.segment_solution import last_errors, solve_all
from sysid_node.online.state import (
    ControlLines,
    EstimatorState,
    Steps,
)
from sysid_node.online.systematic import estimation
from sysid_node.online.systematic.estimation import SystematicErrors
from sysid_node.online.systematic.imperfections import line_model, remapped
from sysid_node.online.systematic.servo_model import ServoModel

Array = NDArray[np.float64]
SERVO_STEPS = 2  # changes of the servos at most in one renewal


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
    yield from solve_all(state, measure_segment(state, lines), (place, share))
    return last_errors(state)


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
        state.segment.first_impulses = state.segment.first_servos.impulses(impulse(model.spectrum.omega, first.time))
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
