"""Reads PX4's ULog files through pyulog."""

from __future__ import annotations

import mmap
from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.errors import InputError
from sysid_node.flight.logs.autopilot_log import (
    AIRSPEED,
    CONTROLS,
    IMU,
    AutopilotLog,
    LoggedCommands,
    Signal,
    absent,
    joined,
)
from sysid_node.flight.logs.flown import Condition, Spans, spans_where
from sysid_node.flight.logs.outliers import in_order, said_of
from sysid_node.flight.logs.readers.packages import quietly, required
from sysid_node.flight.logs.readers.px4_controls import control_commands
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Stamps

_PROFILE = (
    "SDLOG_PROFILE = 27 logs it in full (bits 0 default, 1 estimator replay, 3 system identification, 4 high rate)"
)

_CUT_SHORT = "the file ends within a message: the log was cut short, by a loss of power or when it was copied"

_REMEDIES = {IMU: _PROFILE, AIRSPEED: _PROFILE, CONTROLS: _PROFILE}

_ARMED, _FIXED_WING = 2, 2  # vehicle_status: arming_state, vehicle_type

#: sensor_combined.accelerometer_timestamp_relative where the accelerometer's time is invalid.
_INVALID = 2**31 - 1


def read_ulog(path: str | Path) -> AutopilotLog:
    """The signals of a PX4 log. Raises InputError where the file is damaged or pyulog is not installed."""
    path = Path(path)
    core = required("pyulog.core", "PX4's logs")
    try:
        with quietly():  # pyulog prints what it makes of a damaged file
            log = _Topics(core.ULog(str(path)))
        cut = not (log.ulog.file_corruption or log.ulog.has_data_appended) and _ends_within_a_message(path)
    except Exception as error:  # the parser of a damaged file raises all kinds of exceptions
        words = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path.name}: cannot be read as a PX4 log: {words}; copy it again from the card") from error
    return _converted(log, path.name, (_CUT_SHORT,) if cut else ())


def _ends_within_a_message(path: Path) -> bool:
    """Whether the last message is not whole: a header of 16 bytes, then messages that begin with their sizes."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        at = 16
        while at + 2 < len(content):
            at += 3 + content[at] + 256 * content[at + 1]
        return at != len(content)


class _Topics:
    """The topics of a ULog, as signals."""

    def __init__(self, ulog: Any) -> None:
        self.ulog = ulog
        self.data = {(one.name, one.multi_id): one.data for one in ulog.data_list}
        self.left_out = 0  # messages
        for key, columns in self.data.items():
            keep = in_order(np.asarray(columns["timestamp"], np.int64) * 1000)
            self.left_out += int(np.count_nonzero(~keep))
            self.data[key] = columns if keep.all() else {name: values[keep] for name, values in columns.items()}
        self.parameters: dict[str, float] = {name: float(value) for name, value in ulog.initial_parameters.items()}

    def fields(self, topic: str) -> dict[str, Array]:
        """The columns of a topic, written ``name`` or ``name/instance``; empty where it is not in the log."""
        name, _, instance = topic.partition("/")
        found: dict[str, Array] = self.data.get((name, int(instance or 0)), {})
        if instance and not found:  # an instance alone in the log has the number zero
            found = self.data.get((name, 0), {})
        return found

    def stamps(self, topic: str) -> Stamps:
        """When the samples were taken, ns since the autopilot's start; else when they were published."""
        fields = self.fields(topic)
        sampled = fields.get("timestamp_sample", np.zeros(1))
        micros = sampled if np.all(sampled > 0) and topic == "vehicle_attitude" else fields.get("timestamp")
        return np.empty(0, np.int64) if micros is None else np.asarray(micros, np.int64) * 1000

    def signal(self, topic: str, columns: tuple[str, ...]) -> Signal:
        """Some columns of a topic, NaN for one that it lacks."""
        fields, stamps = self.fields(topic), self.stamps(topic)
        missing = np.full(stamps.size, np.nan)
        values = [np.asarray(fields.get(column, missing), float) for column in columns]
        return Signal(
            topic.partition("/")[0], stamps, np.column_stack(values) if stamps.size else np.empty((0, len(columns)))
        )


def _converted(log: _Topics, name: str, damage: tuple[str, ...]) -> AutopilotLog:
    status = log.fields("vehicle_status")
    vtol = bool(np.any(status.get("is_vtol", np.zeros(1))))
    controls, remarks = control_commands(log.signal, log.parameters, vtol=vtol)
    airspeed, airspeed_remarks = _airspeed(log)
    unmapped, banks = "; ".join(remarks), _banks(log)
    outputs = joined(banks, banks[0].signal if banks else absent("actuator_outputs", 0))
    imu = _imu(log)
    dropped = sum(dropout.duration for dropout in log.ulog.dropouts) / 1000.0
    if dropped:
        remarks += (f"the logger lost {dropped:.2f} s in {len(log.ulog.dropouts)} dropouts; use a faster card",)
    if log.ulog.file_corruption:
        remarks += ("the file is damaged; the readable part is used",)
    return AutopilotLog(
        name=name,
        autopilot=f"PX4 {_version(log.ulog)}".strip(),
        imu=imu,
        attitude=log.signal("vehicle_attitude", tuple(f"q[{i}]" for i in range(4))),
        airspeed=airspeed,
        density=log.signal("vehicle_air_data", ("rho",)),
        controls=controls,
        outputs=outputs,
        banks=banks,
        vanes=_vanes(log),
        flown=_flown(log, int(imu.stamp_ns[-1]) if len(imu) else 0),
        remarks=(*remarks, *airspeed_remarks, *damage, *said_of(log.left_out)),
        remedies=_REMEDIES,
        lacks=_lacks(controls, outputs),
        unmapped=unmapped,
    )


def _lacks(controls: LoggedCommands, outputs: LoggedCommands) -> dict[str, str]:
    """Commands that were not logged at all: those of motors alone move no surface."""
    surfaces = [name for name in outputs.names if not name.startswith("motor")]
    return {} if controls.names or surfaces else {CONTROLS: f"no {controls.signal.source} in it; {_PROFILE}"}


def _version(ulog: Any) -> str:
    release = int(ulog.msg_info_dict.get("ver_sw_release", 0))
    return f"{release >> 24 & 255}.{release >> 16 & 255}.{release >> 8 & 255}" if release else ""


def _imu(log: _Topics) -> Signal:
    """sensor_combined, which is the estimator's IMU in body axes; without it the filtered signals of the controller."""
    force = tuple(f"accelerometer_m_s2[{i}]" for i in range(3))
    rates = tuple(f"gyro_rad[{i}]" for i in range(3))
    raw = log.signal("sensor_combined", (*force, *rates))
    if len(raw):
        shift = log.fields("sensor_combined").get("accelerometer_timestamp_relative", np.zeros(1))
        raw.values[np.broadcast_to(shift == _INVALID, len(raw)), :3] = np.nan
        return raw
    rate = log.signal("vehicle_angular_velocity", tuple(f"xyz[{i}]" for i in range(3)))
    force_filtered = log.signal("vehicle_acceleration", tuple(f"xyz[{i}]" for i in range(3)))
    if not len(rate) or not len(force_filtered):
        return absent("sensor_combined", 6)
    at = (rate.stamp_ns - force_filtered.stamp_ns[0]) / 1e9
    known = (force_filtered.stamp_ns - force_filtered.stamp_ns[0]) / 1e9
    columns = [np.interp(at, known, c, left=np.nan, right=np.nan) for c in force_filtered.values.T]
    slower = rate if len(rate) < len(force_filtered) else force_filtered
    return Signal(slower.source, rate.stamp_ns, np.column_stack([*columns, rate.values]))


def _airspeed(log: _Topics) -> tuple[Signal, tuple[str, ...]]:
    """The validated airspeed where a sensor measured it, or the sensor's own where that was logged faster.

    The sensor's is multiplied by the scale that the validated one contains, and taken where the validated one is of
    this sensor: PX4 turns to another source where it finds that a sensor is blocked.
    """
    fields = log.fields("airspeed_validated")
    valid = log.signal("airspeed_validated", ("true_airspeed_m_s",))
    source = fields.get("airspeed_source", fields.get("selected_airspeed_index"))
    if source is None or not len(valid):
        raw = log.signal("airspeed", ("true_airspeed_m_s",))
    else:
        measured = (source >= 1) & (source <= 3)
        valid.values[~measured] = np.nan
        if not np.any(measured):
            return valid, ()
        sensor = int(np.bincount(source[measured]).argmax())
        raw = log.signal(f"airspeed/{sensor - 1}" if sensor > 1 else "airspeed", ("true_airspeed_m_s",))
        place = np.searchsorted(valid.stamp_ns, raw.stamp_ns, side="right") - 1
        raw.values[source[np.maximum(place, 0)] != sensor] = np.nan
    if not len(raw) or len(raw) <= 1.5 * len(valid):
        return valid if len(valid) else raw, ()
    scale = _scale_between(raw, valid)
    remark = f"airspeed: the sensor's own samples, times {scale:.3f} of airspeed_validated"
    return Signal("airspeed", raw.stamp_ns, raw.values * scale), (remark,)


def _scale_between(raw: Signal, valid: Signal) -> float:
    """The ratio of the validated airspeed to the sensor's in flight; 1 where it cannot be told."""
    if len(valid) < 5:
        return 1.0
    at = np.interp(valid.stamp_ns.astype(float), raw.stamp_ns.astype(float), raw.values[:, 0])
    fast = (at > 5.0) & np.isfinite(valid.values[:, 0])
    return float(np.median(valid.values[fast, 0] / at[fast])) if np.count_nonzero(fast) >= 5 else 1.0


def _vanes(log: _Topics) -> Signal | None:
    """Angle of attack and sideslip, which PX4 logs where vanes are connected; an estimate of a filter is none."""
    alpha, beta = (_vane(log, topic) for topic in ("airflow_aoa", "airflow_slip"))
    found = alpha or beta
    if found is None:
        return None
    columns = [_at_times(vane, found) if vane is not None else np.full(len(found), np.nan) for vane in (alpha, beta)]
    return Signal(found.source, found.stamp_ns, np.column_stack(columns))


def _vane(log: _Topics, topic: str) -> Signal | None:
    """The angle (N, 1) of a vane's topic, NaN where the sensor was out of its range (``valid``, airflow_aoa.msg).

    None where it was never valid.
    """
    angle = next((name for name in log.fields(topic) if name.endswith("_rad")), None)
    if angle is None:
        return None
    signal = log.signal(topic, (angle,))
    signal.values[np.asarray(log.fields(topic).get("valid", np.ones(len(signal)))) == 0] = np.nan
    return signal if np.isfinite(signal.values).any() else None


def _at_times(signal: Signal, other: Signal) -> Array:
    values: Array = np.interp(
        other.stamp_ns.astype(float), signal.stamp_ns.astype(float), signal.values[:, 0], left=np.nan, right=np.nan
    )
    return values


def _banks(log: _Topics) -> tuple[LoggedCommands, ...]:
    """The outputs by the names in the aircraft file: main1.., aux1.. (pulses), servo1.., motor1.. (-1..1)."""
    banks = {"main": log.signal("actuator_outputs", tuple(f"output[{i}]" for i in range(8)))}
    if ("actuator_outputs", 1) in log.data:
        banks["aux"] = log.signal("actuator_outputs/1", tuple(f"output[{i}]" for i in range(8)))
    banks["servo"] = log.signal("actuator_servos", tuple(f"control[{i}]" for i in range(8)))
    banks["motor"] = log.signal("actuator_motors", tuple(f"control[{i}]" for i in range(12)))
    return tuple(
        LoggedCommands(tuple(f"{bank}{i + 1}" for i in range(signal.values.shape[1])), signal)
        for bank, signal in banks.items()
        if len(signal)
    )


def _flown(log: _Topics, end_ns: int) -> Spans | None:
    """When it was armed, a fixed wing, in no transition, and had not landed."""
    status, landed = log.fields("vehicle_status"), log.fields("vehicle_land_detected")
    conditions = []
    if status:
        stamps = log.stamps("vehicle_status")
        flies = status["arming_state"] == _ARMED
        if "vehicle_type" in status:
            flies = flies & (status["vehicle_type"] == _FIXED_WING)
        elif "is_rotary_wing" in status:
            flies = flies & (status["is_rotary_wing"] == 0)
        if "in_transition_mode" in status:
            flies = flies & (status["in_transition_mode"] == 0)
        conditions.append(Condition(stamps, np.asarray(flies, bool)))
    if landed:
        conditions.append(Condition(log.stamps("vehicle_land_detected"), np.asarray(landed["landed"] == 0, bool)))
    return spans_where(conditions, end_ns)
