"""What moved the aircraft, as far as the log or the aircraft file tells: controls by name, or outputs and joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.logs.autopilot_log import AutopilotLog, LoggedCommands, Signal
from sysid_node.flight.logs.flown import within
from sysid_node.flight.logs.log_streams import flight_of_log
from sysid_node.flight.streams import COMMAND_FRACTIONS, JointStream
from sysid_node.flight.topics import ACTUATORS


class Inputs(NamedTuple):
    """Commands or positions, and their ``unit``: "rad", "fraction" of the full command, or "" for raw outputs."""

    commands: LoggedCommands
    unit: str

    def spread(self, value: float) -> str:
        """A root mean square of theirs as a text; empty for raw outputs."""
        return {"rad": f"{np.degrees(value):.1f} deg of ", "fraction": f"{100.0 * value:.1f} % of "}.get(self.unit, "")


def inputs_of_log(log: AutopilotLog, aircraft: Aircraft | None) -> Inputs:
    """The inputs of the part that was flown: by the aircraft's ``outputs``, by the log's parameters, or as logged."""
    if aircraft is not None and aircraft.outputs:
        try:
            return inputs_of_joints(flight_of_log(log, aircraft.outputs).streams.actuators, aircraft)
        except InputError:
            pass  # the refusal says why
    commands = log.controls if log.controls.names else log.outputs
    signal = commands.signal.selected(within(log.flown or None, commands.signal.stamp_ns))
    return Inputs(LoggedCommands(commands.names, signal), "fraction" if log.controls.names else "")


def inputs_of_joints(joints: JointStream, aircraft: Aircraft | None) -> Inputs:
    """The inputs of a bag or a table: the aircraft's controls where it is known and has these joints."""
    stamps, source = joints.arrival.stamp_ns, joints.source or ACTUATORS
    if joints.content == COMMAND_FRACTIONS:
        return Inputs(LoggedCommands(joints.names, Signal(source, stamps, joints.positions)), "fraction")
    if aircraft is not None:
        actuation = Actuation.of(aircraft)
        if set(actuation.joints) <= set(joints.names):
            controls = actuation.of_array(joints.names, joints.positions)[0][:, 1:]
            return Inputs(LoggedCommands(tuple(aircraft.controls), Signal(source, stamps, controls)), "rad")
    return Inputs(LoggedCommands(joints.names, Signal(source, stamps, joints.positions)), "rad")
