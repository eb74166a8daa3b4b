"""The adaptive controller: ``init``, ``receive_estimates`` for new estimates, ``step`` for every command.

    state = init(aircraft, settings)
    receive_correlation(state, correlation)               # of the estimates' errors, where it is known
    receive_estimates(state, time, estimates)             # {"Cm_de": IdentifiedDerivative(...), ...}
    command = step(state, measured, set_points)           # rad, N

Without recent estimates, or where a sensor is silent, it flies the baseline: the gains for the aircraft file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.control import adaptation
from sysid_node.control.adaptation import AxisAdaptation
from sysid_node.control.design.axis import axes
from sysid_node.control.inputs.input_checks import InputChecks
from sysid_node.control.law import control_law
from sysid_node.control.law.control_law import LONGEST_STEP, LawState
from sysid_node.control.law.tracking import TrackingWatch
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import Command, ErrorCorrelation, IdentifiedDerivative, Measurements, SetPoints

NO_EXCITATION = (0.0, 0.0, 0.0)
FIRST_STEP = 0.005  # s
FOREIGN_CLOCK = 3600.0  # s between the stamps of estimates and IMU, beyond which they are of different clocks


@dataclass
class ControllerState:
    """The state of the controller."""

    settings: ControllerSettings
    axes: tuple[AxisAdaptation, AxisAdaptation]  # pitch, lateral
    law: LawState
    checks: InputChecks
    tracking: TrackingWatch
    time: float = math.nan  # s, of the last step
    estimates_time: float = -math.inf  # s, of the last estimates
    correlation: ErrorCorrelation | None = None  # of the estimates' errors
    stale: str = "no estimates yet"  # the reason why the baseline is flown; empty where estimates are used


def init(aircraft: Aircraft, settings: ControllerSettings) -> ControllerState:
    """A controller that flies the baseline.

    Raises InputError where the aircraft file or the actuators do not suffice.
    """
    pitch, lateral = (adaptation.init(axis) for axis in axes(aircraft, settings.actuator_lag, settings.delay))
    flown = control_law.init(aircraft, settings)
    checks = InputChecks(np.minimum(flown.design.limits, settings.largest_excitation))
    return ControllerState(settings, (pitch, lateral), flown, checks, TrackingWatch(settings.largest_tracking_error))


def receive_correlation(state: ControllerState, correlation: ErrorCorrelation) -> None:
    """Take a new correlation of the estimates' errors; one that cannot be meant leaves them with none."""
    state.correlation = state.checks.correlation(correlation)


def receive_estimates(state: ControllerState, time: float, estimates: Mapping[str, IdentifiedDerivative]) -> None:
    """Take new estimates at a time (s, by the sensors' clock)."""
    state.estimates_time, estimates = time, state.checks.estimates(estimates)
    if state.settings.adapt and not state.stale:
        for axis in state.axes:
            adaptation.consider(axis, estimates, state.settings, time, state.correlation)


def step(
    state: ControllerState, measured: Measurements, points: SetPoints, excitation: Sequence[float] = NO_EXCITATION
) -> Command:
    """The command at ``measured.time``; ``excitation`` (rad) of elevator, aileron and rudder is added to it.

    Measurements that are implausible count as not measured, and the excitation is limited; ``checks`` counts both.
    """
    measured, added = state.checks.measurements(measured), state.checks.excitation(excitation)
    elapsed = measured.time - state.time
    duration = min(elapsed, LONGEST_STEP) if elapsed > 0.0 else FIRST_STEP
    state.time = measured.time
    state.stale = _stale_reason(state, measured)
    for axis in state.axes:
        if state.stale:
            adaptation.fall_back(axis, state.stale, measured.time)
            if state.tracking.lost:
                adaptation.forget(axis)
        else:
            adaptation.resume(axis, measured.time)
    for axis in state.axes:
        adaptation.advance(axis, state.settings, duration)
    pitch, lateral = state.axes
    parameters = ((pitch.axis, pitch.flown), (lateral.axis, lateral.flown))
    command = control_law.step(state.law, measured, points, parameters, added, duration)
    if state.law.wanted is not None:
        state.tracking.update(measured, state.law.wanted)
    return command


def _stale_reason(state: ControllerState, measured: Measurements) -> str:
    """Why the baseline must be flown: a silent sensor or old estimates; empty where estimates may be used."""
    silent = [name for name, value in measured._asdict().items() if not math.isfinite(value)]
    if silent:
        return f"{silent[0]} not measured"
    if not state.settings.adapt:
        return "adaptation is off"
    if state.tracking.lost:
        return f"the tracking error was over {state.settings.largest_tracking_error:g} rad"
    age = abs(measured.time - state.estimates_time)  # the clock may step back
    if math.isfinite(age) and age > FOREIGN_CLOCK:
        return "the stamps of estimates and IMU are of different clocks"
    if age > state.settings.stale_after:
        return f"no estimates for {age:.1f} s" if math.isfinite(age) else "no estimates yet"
    return ""
