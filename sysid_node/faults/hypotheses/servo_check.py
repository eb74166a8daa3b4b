"""Do the surfaces go where they are told? Their measured positions beside their commands, where both are there.

A position that stays farther from the command, behind the servo's lag, than the servo's error allows is that of a
surface that is stuck, or hard over (Ducard, "Fault-tolerant Flight Control and Guidance Systems" (2009), ch. 3). Where
``actuators`` echoes the commands there is nothing to be seen here, and the forces must tell.
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

LASTING = 0.3  # s that a surface must be off
FOLLOWING = 1.0  # s that it must be where it should, to be taken for sound again
STILL = 0.005  # rad: one that moves less is stuck
RECENT = 0.5  # s of positions by which that is told
COMMAND_AGE = 0.15  # s, after which commands no longer count


@dataclass
class ServoState:
    """What is remembered of the controls, in the aircraft file's order."""

    names: tuple[str, ...]
    limits: Array
    settings: FaultMonitorSettings
    command: Array  # rad, NaN before the first
    off_since: Array  # s, inf = where it should be
    off_at: Array  # s, when it was last not where it should be
    coming: deque[tuple[float, Array]] = field(default_factory=lambda: deque(maxlen=2000))  # commands by time (s)
    commanded: float = -math.inf  # s
    expected: Array | None = None  # behind the lag
    time: float = math.nan  # s, of the last positions
    recent: deque[tuple[float, Array]] = field(default_factory=deque)
    found: dict[str, Fault] = field(default_factory=dict)


def init(aircraft: Aircraft, settings: FaultMonitorSettings) -> ServoState:
    """Nothing heard."""
    limits = np.array([control.limit or LIMIT for control in aircraft.controls.values()])
    never = np.full(limits.size, math.inf)
    return ServoState(tuple(aircraft.controls), limits, settings, np.full(limits.size, math.nan), never, -never)


def command(state: ServoState, time: float, controls: Sequence[float]) -> None:
    """What the controls (rad) are told at a time (s, of the positions' clock)."""
    if state.coming and time < state.coming[-1][0]:
        state.coming.clear()  # the clock has stepped back
    state.coming.append((time, np.clip(controls, -state.limits, state.limits)))


def position(state: ServoState, time: float, controls: Sequence[float]) -> list[Fault]:
    """Where the controls (rad) are at a time (s); returns what is wrong with them at present.

    Nothing is, where the commands of that time have not come: they may be on their way.
    """
    found = np.asarray(controls, dtype=float)
    while state.coming and state.coming[0][0] <= time:
        state.commanded, state.command = state.coming.popleft()
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
    for i, name in enumerate(state.names):
        if time - state.off_since[i] >= LASTING:
            state.found[name] = _fault(state, i, time, state.found.get(name))
        elif time - state.off_at[i] > FOLLOWING:
            state.found.pop(name, None)
    return list(state.found.values())


def _forget(state: ServoState) -> None:
    state.expected, state.off_since = None, np.full(state.limits.size, math.inf)
    state.recent.clear()
    state.found.clear()


def _fault(state: ServoState, i: int, now: float, before: Fault | None) -> Fault:
    """Of a control that is not where it should be."""
    places = np.array([row[i] for _, row in state.recent])
    if np.ptp(places) > STILL:
        kind = NOT_FOLLOWING
    else:
        kind = HARD_OVER if abs(places[-1]) >= AT_LIMIT * state.limits[i] else STUCK
    since = before.since if before else float(state.off_since[i])
    found = before.found if before else now
    size = float(places[-1])
    return Fault(kind, state.names[i], size, math.nan, math.nan, "rad", since, found, 1.0, source=POSITION)
