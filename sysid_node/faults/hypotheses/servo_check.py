"""Compares the measured positions of the surfaces with their commands, where both are available.

A surface whose position differs from the lagged command by more than the servo's error for some time is stuck, hard
over or does not follow (Ducard, "Fault-tolerant Flight Control and Guidance Systems" (2009), ch. 3). The fault ends
when the position has agreed with the command for some time and has moved meanwhile. Where
``actuators`` repeats the commands, this check finds nothing, and faults are found by forces alone.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.faults.hypotheses.catalogue import LIMIT
from sysid_node.faults.report import AT_LIMIT
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.types import HARD_OVER, NOT_FOLLOWING, POSITION, STUCK, Fault

Array = NDArray[np.float64]

LASTING = 0.3  # s for which a position must differ, to be a fault
FOLLOWING = 1.0  # s for which it must agree, to end the fault
MOVED = 0.5  # of the servo's error by which it must move meanwhile, as a stuck surface agrees with a command at rest
STILL = 0.005  # rad: a surface that moves less is stuck
RECENT = 0.5  # s of positions that decide whether it moves
COMMAND_AGE = 0.15  # s: older commands are not compared


@dataclass
class ServoCheckState:
    """The state of the check, for the controls in the aircraft file's order."""

    names: tuple[str, ...]
    limits: Array
    settings: FaultMonitorSettings
    command: Array  # rad, NaN before the first
    off_since: Array  # s, beginning of the present difference; inf = none
    off_at: Array  # s, time of the last difference
    lowest: Array  # rad, of the positions since then
    highest: Array
    pending: deque[tuple[float, Array]] = field(default_factory=lambda: deque(maxlen=2000))  # commands by time (s)
    commanded: float = -math.inf  # s
    expected: Array | None = None  # behind the lag
    time: float = math.nan  # s, of the last positions
    recent: deque[tuple[float, Array]] = field(default_factory=deque)
    found: dict[str, Fault] = field(default_factory=dict)


def init(aircraft: Aircraft, settings: FaultMonitorSettings) -> ServoCheckState:
    """The state before the first message."""
    limits = np.array([control.limit or LIMIT for control in aircraft.controls.values()])
    never = np.full(limits.size, math.inf)
    none = np.full(limits.size, math.nan)
    return ServoCheckState(tuple(aircraft.controls), limits, settings, none, never, -never, never, -never)


def command(state: ServoCheckState, time: float, controls: Sequence[float]) -> None:
    """Take a command to the controls (rad) at a time (s, by the positions' clock)."""
    if state.pending and time < state.pending[-1][0]:
        state.pending.clear()  # the clock has stepped back
    state.pending.append((time, np.clip(controls, -state.limits, state.limits)))


def position(state: ServoCheckState, time: float, controls: Sequence[float]) -> list[Fault]:
    """Take the positions of the controls (rad) at a time (s); returns the present faults.

    There are none while the commands of that time are missing, as they may arrive later.
    """
    found = np.asarray(controls, dtype=float)
    while state.pending and state.pending[0][0] <= time:
        state.commanded, state.command = state.pending.popleft()
    if not abs(time - state.commanded) <= COMMAND_AGE:
        _forget(state)
        return []
    passed = time - state.time
    state.time = time
    if state.expected is None or not 0.0 < passed < COMMAND_AGE:
        _forget(state)
        state.expected, state.time = found.copy(), time
        return []
    state.expected += (1.0 - math.exp(-passed / state.settings.actuator_lag)) * (state.command - state.expected)
    state.recent.append((time, found))
    while state.recent[0][0] < time - RECENT:
        state.recent.popleft()
    off = np.abs(found - state.expected) > state.settings.servo_error
    state.off_since = np.where(off, np.minimum(state.off_since, time), math.inf)
    state.off_at = np.where(off, time, state.off_at)
    state.lowest = np.where(off, found, np.minimum(state.lowest, found))
    state.highest = np.where(off, found, np.maximum(state.highest, found))
    moved = state.highest - state.lowest > MOVED * state.settings.servo_error
    for i, name in enumerate(state.names):
        if time - state.off_since[i] >= LASTING:
            state.found[name] = _fault(state, i, time, state.found.get(name))
        elif time - state.off_at[i] > FOLLOWING and moved[i]:
            state.found.pop(name, None)
    return list(state.found.values())


def _forget(state: ServoCheckState) -> None:
    state.expected, state.off_since = None, np.full(state.limits.size, math.inf)
    state.recent.clear()
    state.found.clear()


def _fault(state: ServoCheckState, i: int, now: float, before: Fault | None) -> Fault:
    """The fault of a control whose position differs from its command."""
    places = np.array([row[i] for _, row in state.recent])
    if np.ptp(places) > STILL:
        kind = NOT_FOLLOWING
    else:
        kind = HARD_OVER if abs(places[-1]) >= AT_LIMIT * state.limits[i] else STUCK
    since = before.since if before else float(state.off_since[i])
    found = before.found if before else now
    size = float(places[-1])
    return Fault(kind, state.names[i], size, math.nan, math.nan, "rad", since, found, 1.0, source=POSITION)
