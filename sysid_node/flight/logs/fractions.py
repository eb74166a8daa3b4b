"""The aircraft's joints from a log's commands: from fractions of the full command, and between their samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.streams import COMMANDS, Arrival, JointStream


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


#: Commands are held from message to message. Between samples of a slower log than this, Hz, they are interpolated.
_FINE = 200.0
_LONGEST_BRIDGE_NS = 500_000_000


def between_commands(joints: JointStream) -> JointStream:
    """Commands at 200 Hz on the lines between a log's samples, where these are fewer.

    An autopilot computes commands at 100 to 400 Hz, of which a log holds some. To hold a sample until the next would
    delay them by half of the log's period on average. The log's period is kept as the ``interval``: the time of a step
    is not known within it.
    """
    stamps = joints.arrival.stamp_ns
    steps = np.diff(stamps)
    if stamps.size < 2 or int(steps.min()) <= 0:
        return joints
    interval = float(np.median(steps)) / 1e9
    if interval <= 1.5 / _FINE:
        return joints
    parts = np.minimum(np.ceil(steps * _FINE / 1e9), 1e3).astype(np.int64)
    parts[steps > _LONGEST_BRIDGE_NS] = 1
    place = np.repeat(np.arange(parts.size), parts)
    share = np.concatenate([np.arange(count) / count for count in parts.tolist()])
    fine = np.append(stamps[place] + np.round(share * steps[place]).astype(np.int64), stamps[-1])
    moved = share[:, np.newaxis] * np.diff(joints.positions, axis=0)[place]
    positions = np.vstack([joints.positions[place] + moved, joints.positions[-1:]])
    arrival = Arrival(fine, fine, np.arange(fine.size, dtype=np.int64))
    return replace(joints, arrival=arrival, positions=positions, interval=interval)
