"""The streams of the part of an autopilot's log that was flown as a fixed wing, and the aircraft's joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sysid_node.flight.autopilots.joints import joints_of
from sysid_node.flight.logs.air_data import air_data, attitude_at
from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, IMU, AutopilotLog, Signal, with_outputs_of
from sysid_node.flight.logs.checks.refusals import Refusal, missing_signals, require
from sysid_node.flight.logs.flown import seconds, within
from sysid_node.flight.streams import (
    COMMAND_FRACTIONS,
    COMMANDS,
    AirDataStream,
    Arrival,
    ImuStream,
    JointStream,
    Streams,
    in_order_of_logging,
)


class LogFlight(NamedTuple):
    """A log's streams, and what was done to get them, a sentence each."""

    streams: Streams
    remarks: tuple[str, ...]


def flight_of_log(log: AutopilotLog, outputs: str = "", key: str = "outputs") -> LogFlight:
    """The streams of the part of a log that was flown as a fixed wing.

    ``outputs``: which output moves which joint, as in the aircraft file; without it the log's parameters say that, and
    the actuators are fractions of full command. Raises InputError where a signal is missing or nothing was flown, or
    where ``outputs``, which ``key`` states, are wrong.
    """
    log = with_outputs_of(log, outputs)
    require(log.name, Refusal(missing_signals(log, raw_outputs=bool(outputs))))
    imu = _flown_part(log, log.imu)
    airspeed = _flown_part(log, log.airspeed)
    attitude = attitude_at(log.attitude, imu.stamp_ns)
    air, remarks = air_data(log, imu, attitude, airspeed)
    joints = _joints(log, outputs, key)
    all_remarks = (*part_remarks(log), *remarks, *log.remarks)
    streams = Streams(
        ImuStream(_arrival(imu), imu.values, attitude, "base_link", source=imu.source, remedy=_remedy(log, IMU)),
        AirDataStream(_arrival(air), air.values, source=airspeed.source, remedy=_remedy(log, AIRSPEED)),
        joints,
        log.name,
    )
    return LogFlight(in_order_of_logging(streams), all_remarks)


def _remedy(log: AutopilotLog, role: str) -> str:
    return log.remedies.get(role, "")


def _example(outputs: tuple[str, ...]) -> str:
    scaled = {"out": "1500:0.001", "mai": "1500:0.001", "aux": "1500:0.001"}
    name = outputs[min(1, len(outputs) - 1)] if outputs else "out2"
    return f"elevator={name}:{scaled.get(name[:3], '0:0.4')}"


def _flown_part(log: AutopilotLog, signal: Signal) -> Signal:
    return signal.selected(within(log.flown, signal.stamp_ns))


def part_remarks(log: AutopilotLog) -> tuple[str, ...]:
    """Which part of the log is taken, a sentence; nothing where the log has no IMU."""
    if not len(log.imu):
        return ()
    if log.flown is not None and not log.flown:
        return ("never flew as a fixed wing (on the ground, or hovering)",)
    if log.flown is None:
        return ("the log does not say when it flew; all of it is taken",)
    whole = (int(log.imu.stamp_ns[-1]) - int(log.imu.stamp_ns[0])) / 1e9
    start = int(log.imu.stamp_ns[0])
    spans = ", ".join(f"{max(a - start, 0) / 1e9:.1f} to {(b - start) / 1e9:.1f} s" for a, b in log.flown[:4])
    more = ", ..." if len(log.flown) > 4 else ""
    return (f"flown as a fixed wing: {seconds(log.flown):.1f} of {whole:.1f} s ({spans}{more}); the rest is left out",)


def _arrival(signal: Signal) -> Arrival:
    """Stamps in the log's order; a message is taken to be logged when the latest before it was stamped."""
    logged = np.maximum.accumulate(signal.stamp_ns) if len(signal) else signal.stamp_ns
    return Arrival(signal.stamp_ns, logged, np.arange(len(signal), dtype=np.int64))


def _joints(log: AutopilotLog, outputs: str, key: str) -> JointStream:
    """Joints by the aircraft file's ``outputs``, or the controls as fractions of full command."""
    commands, content = (log.outputs, COMMANDS) if outputs else (log.controls, COMMAND_FRACTIONS)
    signal = _flown_part(log, commands.signal)
    names = commands.names
    values = signal.values
    if outputs:
        joints = joints_of(outputs, names, _example(names), key)
        names = tuple(joint.name for joint in joints)
        places = [commands.names.index(joint.output) for joint in joints]
        values = np.column_stack(
            [joint.scale * (values[:, i] - joint.trim) for joint, i in zip(joints, places, strict=True)]
        )
    whole = Signal(signal.source, signal.stamp_ns, values)
    return JointStream(_arrival(whole), names, values, content, source=signal.source, remedy=_remedy(log, CONTROLS))
