"""The adaptive controller: ``init``, ``hear`` whenever estimates come, ``step`` for every command.

    state = init(aircraft, settings)
    hear(state, time, beliefs)                            # {"Cm_de": Belief(...), ...}
    command = step(state, sensed, set_points)             # rad, N

Without estimates, with old ones, or where a sensor is silent, it flies the gains of the aircraft file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sysid_node.aircraft.model import Aircraft
from sysid_node.control import adaptation, law
from sysid_node.control.adaptation import AxisAdaptation
from sysid_node.control.axis import axes
from sysid_node.control.law import LONGEST_STEP, LawState
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import Command, IdentifiedDerivative, Measurements, SetPoints

NO_EXCITATION = (0.0, 0.0, 0.0)
FIRST_STEP = 0.005  # s


@dataclass
class ControllerState:
    """All that the controller remembers."""

    settings: ControllerSettings
    axes: tuple[AxisAdaptation, AxisAdaptation]  # pitch, lateral
    law: LawState
    time: float = math.nan  # s, of the last step
    heard: float = -math.inf  # s, of the last estimates
    stale: str = "no estimates yet"  # why the baseline is flown; empty where estimates are used


def init(aircraft: Aircraft, settings: ControllerSettings) -> ControllerState:
    """A controller that flies the baseline. Raises InputError where the aircraft's file or actuators do not do."""
    pitch, lateral = (adaptation.init(axis) for axis in axes(aircraft, settings.actuator_lag, settings.delay))
    return ControllerState(settings, (pitch, lateral), law.init(aircraft, settings))


def receive_estimates(state: ControllerState, time: float, beliefs: Mapping[str, IdentifiedDerivative]) -> None:
    """Estimates that came at a time (s) of the sensors' clock."""
    state.heard = time
    if state.settings.adapt and not state.stale:
        for axis in state.axes:
            adaptation.consider(axis, beliefs, state.settings, time)


def step(
    state: ControllerState, sensed: Measurements, points: SetPoints, excitation: Sequence[float] = NO_EXCITATION
) -> Command:
    """The command at ``sensed.time``; ``excitation`` (rad) of elevator, aileron and rudder comes on top."""
    passed = sensed.time - state.time
    duration = min(passed, LONGEST_STEP) if passed > 0.0 else FIRST_STEP
    state.time = sensed.time
    state.stale = _why_not(state, sensed)
    for axis in state.axes:
        if state.stale:
            adaptation.fall_back(axis, state.stale, sensed.time)
        else:
            adaptation.resume(axis, sensed.time)
    for axis in state.axes:
        adaptation.advance(axis, state.settings, duration)
    pitch, lateral = state.axes
    flown = ((pitch.axis, pitch.flown), (lateral.axis, lateral.flown))
    return law.step(state.law, sensed, points, flown, excitation, duration)


def _why_not(state: ControllerState, sensed: Measurements) -> str:
    """Why the baseline is flown: a silent sensor, old estimates; empty where estimates may be used."""
    silent = [name for name, value in sensed._asdict().items() if not math.isfinite(value)]
    if silent:
        return f"{silent[0]} not measured"
    if not state.settings.adapt:
        return "adaptation is off"
    age = abs(sensed.time - state.heard)  # the clock may step back
    if age > state.settings.stale_after:
        return f"no estimates for {age:.1f} s" if math.isfinite(age) else "no estimates yet"
    return ""
