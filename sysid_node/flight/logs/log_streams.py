"""The streams of the part of an autopilot's log that was flown as a fixed wing, and the aircraft's joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sysid_node.errors import InputError
from sysid_node.flight.align import STEP_BACK_NS
from sysid_node.flight.autopilots.joints import joints_of
from sysid_node.flight.logs.air_data import air_data, attitude_at
from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, IMU, AutopilotLog, Signal
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

#: Below this airspeed (m/s) in every sample, nothing was measured: no fixed wing flies so slowly.
_SLOWEST = 2.0


class LogFlight(NamedTuple):
    """A log's streams, and what was done to get them, a sentence each."""

    streams: Streams
    remarks: tuple[str, ...]


def flight_of_log(log: AutopilotLog, outputs: str = "") -> LogFlight:
    """The streams of the part of a log that was flown as a fixed wing.

    ``outputs``: which output moves which joint, as in the aircraft file; without it the log's parameters say that, and
    the actuators are fractions of full command. Raises InputError where a signal is missing or nothing was flown.
    """
    _require_signals(log, outputs)
    imu = _flown_part(log, log.imu)
    airspeed = _flown_part(log, log.airspeed)
    attitude = attitude_at(log.attitude, imu.stamp_ns)
    air, remarks = air_data(log, imu, attitude, airspeed)
    joints = _joints(log, outputs)
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


def _require_signals(log: AutopilotLog, outputs: str) -> None:
    """Raise InputError where IMU, airspeed or controls are missing, or nothing was flown as a fixed wing."""
    if not len(log.imu):
        raise InputError(f"{log.name}: no {log.imu.source} in it; {log.remedies.get(IMU, 'record it too')}")
    _require_one_clock(log)
    if log.flown is not None and not log.flown:
        raise InputError(
            f"{log.name}: {log.autopilot} never flew as a fixed wing in it (on the ground, or hovering); "
            "give a log of a flight"
        )
    missing = missing_airspeed(log)
    if missing:
        raise InputError(f"{log.name}: {missing}")
    if outputs:
        if not len(log.outputs.signal):
            raise InputError(f"{log.name}: no {log.outputs.signal.source} in it; record it too")
        return
    if not log.controls.names or not len(log.controls.signal):
        why = "; ".join(log.remarks) or f"no {log.controls.signal.source} in it"
        raise InputError(
            f"{log.name}: which output moves which surface is not known ({why}); write it into the aircraft file, "
            'e.g. outputs: "elevator=out2:1500:0.001 aileron=out1:1500:0.001"'
        )


def clock_faults(log: AutopilotLog) -> dict[str, str]:
    """By role, what is wrong with the stamps of IMU, airspeed and controls: a step back of more than a second."""
    signals = {IMU: log.imu, AIRSPEED: log.airspeed, CONTROLS: log.controls.signal}
    faults = {}
    for role, signal in signals.items():
        steps = np.diff(signal.stamp_ns)
        if steps.size and int(steps.min()) < -STEP_BACK_NS:
            place = int(np.argmin(steps))
            after = (int(signal.stamp_ns[place]) - int(signal.stamp_ns[0])) / 1e9
            faults[role] = f"the stamps of {signal.source} go back by {-steps[place] / 1e9:.1f} s after {after:.1f} s"
    return faults


def _require_one_clock(log: AutopilotLog) -> None:
    for fault in clock_faults(log).values():
        raise InputError(f"{log.name}: {fault} (a clock was set); cut the log there")


def missing_airspeed(log: AutopilotLog) -> str:
    """What is wrong with the airspeed in the part that was flown, or an empty text."""
    name = log.airspeed.source
    values = log.airspeed.values[within(log.flown or None, log.airspeed.stamp_ns), 0]
    if not values.size:
        return f"no {name} in it; connect an airspeed sensor, and log it"
    if not np.isfinite(values).any():
        return f"{name} never comes from a sensor; connect an airspeed sensor"
    if float(np.nanmax(values)) < _SLOWEST:
        return f"{name} is {float(np.nanmax(values)):.1f} m/s at most: the airspeed sensor did not work"
    return ""


def _flown_part(log: AutopilotLog, signal: Signal) -> Signal:
    return signal.selected(within(log.flown, signal.stamp_ns))


def part_remarks(log: AutopilotLog) -> tuple[str, ...]:
    """Which part of the log is taken, a sentence."""
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


def _joints(log: AutopilotLog, outputs: str) -> JointStream:
    """Joints by the aircraft file's ``outputs``, or the controls as fractions of full command."""
    commands, content = (log.outputs, COMMANDS) if outputs else (log.controls, COMMAND_FRACTIONS)
    signal = _flown_part(log, commands.signal)
    names = commands.names
    values = signal.values
    if outputs:
        joints = joints_of(outputs, names, "elevator=out2:1500:0.001")
        names = tuple(joint.name for joint in joints)
        places = [commands.names.index(joint.output) for joint in joints]
        values = np.column_stack(
            [joint.scale * (values[:, i] - joint.trim) for joint, i in zip(joints, places, strict=True)]
        )
    whole = Signal(signal.source, signal.stamp_ns, values)
    return JointStream(_arrival(whole), names, values, content, source=signal.source, remedy=_remedy(log, CONTROLS))
