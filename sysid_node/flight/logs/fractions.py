"""The aircraft's joints from commands that are fractions of the full command."""

from __future__ import annotations

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.streams import COMMANDS, JointStream


def joints_of_fractions(joints: JointStream, aircraft: Aircraft, flight: str) -> JointStream:
    """The aircraft's joints, commanded, from fractions of full command and the deflections at full command.

    The joints are the smallest from which the aircraft file's map gives the controls. Raises InputError, which names
    the key, where the aircraft file does not say how far a control moves, or the log has no such control.
    """
    controls = list(aircraft.controls.values())
    absent_ones = [control.name for control in controls if control.name not in joints.names]
    if absent_ones:
        raise InputError(
            f"{flight}: {joints.source or 'the log'} commands no {', '.join(absent_ones)}, which {aircraft.name} has; "
            f"it commands {', '.join(joints.names)}"
        )
    unknown = [f"controls.{control.name}.full_deflection" for control in controls if control.full_deflection is None]
    if unknown:
        raise InputError(
            f"aircraft {aircraft.name}: {', '.join(unknown)}: missing; {flight} holds commands as fractions, and no "
            "parameter says how far a surface moves: give the deflection at full command in rad, e.g. 0.44"
        )
    deflections = np.column_stack(
        [
            (control.full_deflection or 0.0) * joints.positions[:, joints.names.index(control.name)]
            for control in controls
        ]
    )
    names = list(dict.fromkeys(joint for control in controls for joint in control.joints))
    scales = np.array([[control.joints.get(name, 0.0) for name in names] for control in controls])
    offsets = np.array([control.offset for control in controls])
    columns = list(((deflections - offsets) @ np.linalg.pinv(scales).T).T)
    throttle = aircraft.throttle
    if throttle is not None and throttle.max_thrust is not None and "throttle" in joints.names:
        names.append(throttle.joint)
        columns.append(joints.positions[:, joints.names.index("throttle")])
    return JointStream(
        joints.arrival, tuple(names), np.column_stack(columns), COMMANDS, source=joints.source, remedy=joints.remedy
    )
