"""Reads MAVLink telemetry logs (.tlog) of ArduPilot and PX4 through pymavlink.

Messages that carry the autopilot's time are stamped by it. ``VFR_HUD`` carries none: it is stamped when the ground
station received it, on the autopilot's clock by the message with the least delay.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.errors import InputError
from sysid_node.flight.autopilots.base import GAS_CONSTANT, SEA_LEVEL_DENSITY
from sysid_node.flight.frames import quaternion_from_euler
from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, IMU, AutopilotLog, LoggedCommands, Signal, absent
from sysid_node.flight.logs.flown import Condition, Spans, spans_where
from sysid_node.flight.logs.readers.ardupilot_controls import control_commands
from sysid_node.flight.logs.readers.packages import quietly, required

_IMUS = ("HIGHRES_IMU", "RAW_IMU", "SCALED_IMU")
_WANTED = [
    *_IMUS,
    *("ATTITUDE", "VFR_HUD", "SCALED_PRESSURE", "SERVO_OUTPUT_RAW", "PARAM_VALUE", "EXTENDED_SYS_STATE", "HEARTBEAT"),
]

#: MAV_TYPE of aircraft that have wings; a ground station and a camera send heartbeats, too.
_WINGED = {1, 19, 20, 21, 22, 23, 24, 25}
_NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID
_AUTOPILOTS = {3: "ArduPilot", 12: "PX4"}

_IN_AIR, _AS_FIXED_WING = 2, 4  # MAV_LANDED_STATE, MAV_VTOL_STATE

_RATE = "request the message at a higher rate (MAV_CMD_SET_MESSAGE_INTERVAL), or give the log of the autopilot's card"
_REMEDIES = {IMU: _RATE, AIRSPEED: _RATE, CONTROLS: _RATE}

_NO_PRESSURE = (
    "no SCALED_PRESSURE in it, by whose density VFR_HUD's airspeed becomes the true one; request that message, too"
)

#: Outside temperature (degC) that the density is computed with: telemetry has the board's alone.
_TEMPERATURE = 15.0


class _Row(NamedTuple):
    received_ns: int
    fields: dict[str, Any]


Rows = dict[str, list[_Row]]


def read_telemetry(path: str | Path) -> AutopilotLog:
    """The signals of a telemetry log. Raises InputError where it is damaged, or pymavlink is not installed."""
    path = Path(path)
    mavutil = required("pymavlink.mavutil", "MAVLink's telemetry logs")
    try:
        with quietly():
            rows, vehicle = _rows(mavutil.mavlink_connection(str(path), dialect="ardupilotmega"))
    except Exception as error:  # the parser of a damaged file raises all kinds of exceptions
        words = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path.name}: cannot be read as a telemetry log: {words}; copy it again") from error
    return _converted(rows, vehicle, path.name)


def _rows(log: Any) -> tuple[Rows, tuple[int, int]]:
    """The messages of the vehicle's autopilot by type, and its MAV_AUTOPILOT and MAV_TYPE."""
    found: dict[tuple[int, int], Rows] = defaultdict(lambda: defaultdict(list))
    vehicles: Counter[tuple[tuple[int, int], int, int]] = Counter()
    while True:
        message = log.recv_match(type=_WANTED)
        if message is None:
            break
        source = (message.get_srcSystem(), message.get_srcComponent())
        fields = message.to_dict()
        kind = fields.pop("mavpackettype")
        if kind == "HEARTBEAT" and fields["autopilot"] != _NO_AUTOPILOT:
            vehicles[(source, fields["autopilot"], fields["type"])] += 1
        found[source][kind].append(_Row(round(message._timestamp * 1e9), fields))  # the only access
    if not vehicles:
        source = max(found, key=lambda one: sum(map(len, found[one].values())), default=(0, 0))
        return found[source], (0, 1)
    (source, autopilot, kind), _ = vehicles.most_common(1)[0]
    return found[source], (autopilot, kind)


def _converted(rows: Rows, vehicle: tuple[int, int], name: str) -> AutopilotLog:
    autopilot = _AUTOPILOTS.get(vehicle[0], "autopilot")
    clock = _Clock(rows)
    parameters = {row.fields["param_id"]: float(row.fields["param_value"]) for row in rows["PARAM_VALUE"]}
    outputs = _outputs(rows, clock)
    controls, remarks = control_commands(outputs, parameters)
    unmapped = remarks
    imu = _imu(rows, clock)
    density = _density(rows, clock)
    remarks += (
        f"air density: from the static pressure at {_TEMPERATURE:g} degC, as telemetry has no outside temperature",
    )
    lacking = {} if len(density) else {AIRSPEED: _NO_PRESSURE}
    if not len(outputs.signal):
        lacking[CONTROLS] = f"no SERVO_OUTPUT_RAW in it; {_RATE}"
    flown = _flown(rows, clock, int(imu.stamp_ns[-1]) if len(imu) else 0)
    return AutopilotLog(
        name=name,
        autopilot=f"{autopilot} by telemetry",
        imu=imu,
        attitude=_attitude(rows, clock),
        airspeed=_airspeed(rows, clock, density),
        density=density,
        controls=controls,
        outputs=outputs,
        flown=flown if vehicle[1] in _WINGED else (),
        remarks=remarks,
        remedies=_REMEDIES,
        lacks=lacking,
        unmapped="; ".join(unmapped),
    )


class _Clock:
    """The autopilot's time of a message, ns."""

    def __init__(self, rows: Rows) -> None:
        boot_times = [(row.received_ns, row.fields["time_boot_ms"] * 1_000_000) for row in rows["ATTITUDE"]]
        self._ahead = min((received - boot for received, boot in boot_times), default=0)

    def of(self, row: _Row) -> int:
        """The message's own time since the start; where it has none or another epoch, when it was received."""
        if "time_boot_ms" in row.fields:
            return int(row.fields["time_boot_ms"]) * 1_000_000
        received = row.received_ns - self._ahead
        stamp = int(row.fields.get("time_usec", 0)) * 1000
        # the counter of 32 bits wraps in 71.6 min
        stamp += round((received - stamp) / (2**32 * 1000)) * 2**32 * 1000
        return stamp if stamp > 0 and abs(stamp - received) < 2_000_000_000 else received


def _signal(rows: list[_Row], clock: _Clock, source: str, columns: tuple[str, ...]) -> Signal:
    if not rows:
        return absent(source, len(columns))
    stamps = np.array([clock.of(row) for row in rows], np.int64)
    values = np.array([[float(row.fields.get(column, math.nan)) for column in columns] for row in rows])
    return Signal(source, stamps, values)


def _imu(rows: Rows, clock: _Clock) -> Signal:
    """The IMU's message that came most often, in SI units."""
    kind = max(_IMUS, key=lambda name: len(rows[name]))
    signal = _signal(rows[kind], clock, kind, ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro"))
    unit = [1.0] * 6 if kind == "HIGHRES_IMU" else [GRAVITY / 1000.0] * 3 + [1.0e-3] * 3
    return Signal(kind, signal.stamp_ns, signal.values * np.array(unit))


def _attitude(rows: Rows, clock: _Clock) -> Signal:
    euler = _signal(rows["ATTITUDE"], clock, "ATTITUDE", ("roll", "pitch", "yaw"))
    return Signal("ATTITUDE", euler.stamp_ns, np.roll(quaternion_from_euler(euler.values, "frd"), 1, axis=1))


def _density(rows: Rows, clock: _Clock) -> Signal:
    pressure = _signal(rows["SCALED_PRESSURE"], clock, "SCALED_PRESSURE", ("press_abs",))
    return Signal(
        pressure.source, pressure.stamp_ns, 100.0 * pressure.values / (GAS_CONSTANT * (_TEMPERATURE + 273.15))
    )


def _airspeed(rows: Rows, clock: _Clock, density: Signal) -> Signal:
    """True airspeed from VFR_HUD's, which is equivalent."""
    equivalent = _signal(rows["VFR_HUD"], clock, "VFR_HUD", ("airspeed",))
    if not len(density):
        equivalent.values[:] = np.nan  # it is no true airspeed
    if not len(equivalent) or not len(density):
        return equivalent
    at = np.interp(equivalent.stamp_ns.astype(float), density.stamp_ns.astype(float), density.values[:, 0])
    return Signal("VFR_HUD", equivalent.stamp_ns, equivalent.values * np.sqrt(SEA_LEVEL_DENSITY / at)[:, np.newaxis])


def _outputs(rows: Rows, clock: _Clock) -> LoggedCommands:
    names = tuple(f"out{i}" for i in range(1, 17))
    first = [row for row in rows["SERVO_OUTPUT_RAW"] if row.fields.get("port", 0) == 0]
    signal = _signal(first, clock, "SERVO_OUTPUT_RAW", tuple(f"servo{i}_raw" for i in range(1, 17)))
    return LoggedCommands(names if len(signal) else (), signal)


def _flown(rows: Rows, clock: _Clock, end_ns: int) -> Spans | None:
    states = rows["EXTENDED_SYS_STATE"]
    stamps = np.array([clock.of(row) for row in states], np.int64)
    landed = np.array([row.fields["landed_state"] for row in states], int)
    vtol = np.array([row.fields["vtol_state"] for row in states], int)
    if not np.any(landed):
        return None
    return spans_where([Condition(stamps, (landed == _IN_AIR) & np.isin(vtol, (0, _AS_FIXED_WING)))], end_ns)
