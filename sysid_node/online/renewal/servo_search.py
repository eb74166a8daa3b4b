"""Servos of which nothing is known before the flight: other solutions are tried, and the more probable one is taken.

The fit has two minima where a motion is about as slow as a servo may be. A slow aileron of an aircraft that rolls at
once answers as a fast aileron does of one that takes as long to roll: roll mode and servo exchange their time
constants. Gauss-Newton steps end in the nearer minimum. So now and then, whenever the data have grown by a share, one
of these servos is taken to be on the other side, late instead of on time or the reverse, and the steps are made from
there, on a copy of the estimator (Nocedal & Wright, "Numerical Optimization", 2nd ed., 2006, sec. 2.2: starts from
several points). Both solutions are then weighed by

    -2 log p = explained energy / noise + imperfections' squares in tolerances + derivatives off the aircraft file's,

with the same noise for both. Of the derivatives' errors Student's distribution with few degrees of freedom is believed,
for a file is now and then far off. If the other solution is surely more probable, it is taken, unless it leaves more
that moves with the controls beside its own noise. If neither surely is, the intervals reach to both: the estimate is
that of a mixture (McLachlan & Peel, "Finite Mixture Models", 2000).

A solution in which a rotation amplifies itself (``regression.damping``) is less probable than any other.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np

from sysid_node.online.regression import damping, mixed_estimation
from sysid_node.online.renewal import segment_solution, servo_steps
from sysid_node.online.renewal.segment_information import measure_segment
from sysid_node.online.state import ChangeWatch, EstimatorState, Steps, current_lines
from sysid_node.online.systematic import estimation
from sysid_node.online.systematic.consider import Fit
from sysid_node.online.systematic.estimation import AlternativeSolution, SystematicErrors
from sysid_node.online.systematic.imperfections import CURVATURE

FIRST, GROWTH = 8.0, 1.3  # s of data with which the first other solution is tried, and by what they grow to the next
#: The same where deflections may be positions as well as commands: few data tell a late servo from a slow motion, and
#: positions, after which no servo comes, are as probable.
FIRST_OF_EITHER = 20.0
LATE, BETWEEN = 0.12, 0.06  # s: where a servo is taken to be that is nearer to zero than the second
PROMPT = 0.02  # s: a servo that is later than this may also be taken to be on time
STEPS = 4  # at most, from there
SURELY = 2.0  # difference of -2 log p with which a solution is taken for another
APART = 1.0  # standard errors by which a servo must differ between two solutions to make them two
NEGLIGIBLE = 1e-3  # probability
IMPOSSIBLE = 1e6  # -2 log p of a rotation that amplifies itself


def try_another_solution(state: EstimatorState) -> Steps[None]:
    """Try one, if it is time, and take it if it is more probable."""
    imperfect, found, search = state.model.imperfections, segment_solution.last_errors(state), state.search
    if imperfect is None or found is None or not imperfect.unknown.size or found.pieces != state.finished.pieces:
        return
    energy = found.energy
    first = FIRST if imperfect.expected[imperfect.unknown].any() else FIRST_OF_EITHER
    if energy < first or search.energy <= energy < GROWTH * search.energy:
        return
    control = int(imperfect.unknown[search.tried % imperfect.unknown.size])
    search.energy, search.tried = energy, search.tried + 1
    search.alternatives.pop(control, None)
    trial = yield from _elsewhere(state, found, control)
    other = segment_solution.last_errors(trial) if trial is not None else None
    if trial is None or other is None or not _apart(other, found, int(imperfect.timed[control]), control):
        return
    less = _improbability(state, found, found.considered.fit, other.considered.fit) - _improbability(
        trial, other, other.considered.fit, found.considered.fit
    )
    if less > SURELY and not _explains_less(other, found):
        yield from _take(state, trial)
        other, less = found, -less
    probability = 1.0 / (1.0 + math.exp(min(-0.5 * min(less, 0.0), 100.0)))
    if probability > NEGLIGIBLE:
        search.alternatives[control] = AlternativeSolution.of(imperfect, other, probability)


def _elsewhere(state: EstimatorState, found: SystematicErrors, control: int) -> Steps[EstimatorState | None]:
    """A copy that has gone on from where one servo is on the other side; None where nothing is found there."""
    imperfect = state.model.imperfections
    assert imperfect is not None and state.controls.servos is not None
    at, late = int(imperfect.timed[control]), state.controls.servos.lateness
    trial = replace(
        state,
        segment=replace(state.segment),
        finished=replace(state.finished, in_window=deque()),
        changes=ChangeWatch([]),
    )
    there = _other_side(float(late[at]), state.search.tried // imperfect.unknown.size)
    by_lateness, by_curvature = np.zeros(late.size), np.zeros(late.size)
    by_lateness[at] = there - late[at]
    by_curvature[at] = CURVATURE * there**2 - state.controls.servos.curvature[at]
    servos = state.controls.servos.moved(by_lateness, by_curvature)
    taken_out = estimation.to_take_out(imperfect, servos, found)
    for order in range(3):
        taken_out[imperfect.servos.start + order * len(imperfect.controls) + control] = 0.0
    for left in reversed(range(STEPS)):
        yield from servo_steps.move_servos(trial, servos)
        lines = current_lines(trial)
        if left == STEPS - 1:
            place = replace(found, taken_out=taken_out)
            yield from segment_solution.solve_all(trial, measure_segment(trial, lines), (place, 1.0))
            there_found = segment_solution.last_errors(trial)
        else:
            there_found = yield from servo_steps.look(trial, lines)
        if there_found is None or trial.controls.servos is None:
            return None
        step = estimation.notable_step(imperfect, trial.controls.servos, there_found)
        if step is None or not left:
            break
        servos = step
    return trial


def _other_side(lateness: float, tried: int) -> float:
    """Where (s) a servo is taken to be. One that is neither late nor prompt is so by turns."""
    if lateness >= BETWEEN or (lateness > PROMPT and tried % 2 == 0):
        return 0.0
    return LATE


def _apart(one: SystematicErrors, other: SystematicErrors, place: int, control: int) -> bool:
    """Whether these are two solutions: a servo differs by more than its error."""
    by = abs(float(one.servos.lateness[place] - other.servos.lateness[place]))
    return by > APART * min(float(one.errors[control]), float(other.errors[control]))


def _improbability(state: EstimatorState, found: SystematicErrors, own: Fit, other: Fit) -> float:
    """-2 log p of a solution but for a constant, with the lesser noise of both fits."""
    latest = state.latest
    assert latest is not None
    noise = np.where(other.noise > 0.0, np.minimum(own.noise, other.noise), 0.0)
    expected, precision = state.model.prior  # (P, C)
    told = np.where(state.equations.structure.belongs > 0.0, precision, 0.0)
    theta, variance = latest.corrected(found)
    of_derivatives = mixed_estimation.improbability(theta - expected, told, variance)
    amplified = damping.amplified(state.equations.structure, theta, variance)
    return own.cost(replace(own, noise=noise)) + of_derivatives + IMPOSSIBLE * len(amplified)


def _explains_less(other: SystematicErrors, found: SystematicErrors) -> bool:
    """Whether the ``other`` fits worse, each by its own noise: more of what it leaves moves with the controls."""
    own, theirs = found.considered.fit, other.considered.fit
    return theirs.cost(theirs) > own.cost(own) + SURELY


def _take(state: EstimatorState, trial: EstimatorState) -> Steps[None]:
    """Go on with the solution of a ``trial``."""
    assert trial.controls.servos is not None
    if trial.controls.servos is not state.controls.servos:
        yield from servo_steps.move_servos(state, trial.controls.servos)
    state.equations, state.latest = trial.equations, trial.latest
    state.segment.information = trial.segment.information
    state.changes.monitor.add_reference(trial.changes.monitor.references[-1])
