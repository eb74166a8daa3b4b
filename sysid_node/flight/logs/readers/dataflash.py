"""Reads ArduPilot's DataFlash logs, binary and text, through pymavlink."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.base import GAS_CONSTANT, SEA_LEVEL_DENSITY
from sysid_node.flight.frames import quaternion_from_euler
from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, IMU, AutopilotLog, LoggedCommands, Signal, absent
from sysid_node.flight.logs.flown import Condition, Spans, spans_where
from sysid_node.flight.logs.outliers import in_order, said_of
from sysid_node.flight.logs.readers.ardupilot_controls import control_commands
from sysid_node.flight.logs.readers.packages import quietly, required
from sysid_node.flight.record import Array

_WANTED = {
    *("IMU", "IMU2", "IMU3", "ATT", "ARSP", "ASP2", "BARO", "RCOU", "RCO2", "RCO3", "STAT", "MODE"),
    *("XKF4", "XKFS", "NKF4", "PARM", "MSG", "AOA"),
}

#: Modes in which a QuadPlane hovers (ArduPlane, ``mode.h``): QSTABILIZE to QACRO, and LOITERALTQLAND.
_HOVERING = {17, 18, 19, 20, 21, 22, 23, 25}

#: Lapse rate of the standard atmosphere, K/m (ICAO Doc 7488, 1993).
_LAPSE = 0.0065

_REMEDIES = {
    IMU: "LOG_BITMASK: set bit 7 (IMU, every loop) and bit 0 (fast attitude), 524287 for everything",
    AIRSPEED: "LOG_BITMASK has no bit that logs ARSP faster; below 5 Hz look for dropped messages (DSF.Dp)",
    CONTROLS: "LOG_BITMASK: set bit 13 (RC): RCOU then comes at 25 Hz, which serves for smooth commands, not for steps",
}

_NO_BARO = "no BARO in it, by whose density ARSP becomes the true airspeed; LOG_BITMASK: set bit 7 (IMU)"

Rows = dict[str, list[dict[str, Any]]]


def read_dataflash(path: str | Path, *, text: bool = False) -> AutopilotLog:
    """The signals of a DataFlash log. Raises InputError where it is damaged, or pymavlink is not installed."""
    path = Path(path)
    reader = required("pymavlink.DFReader", "ArduPilot's logs")
    try:
        with quietly():  # pymavlink prints every byte that it skips in a damaged file
            log = (reader.DFReader_text if text else _advancing(reader.DFReader_binary))(str(path))
            rows = _rows(log)
    except Exception as error:  # the parser of a damaged file raises all kinds of exceptions
        words = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path.name}: cannot be read as an ArduPilot log: {words}; copy it again") from error
    return _converted(*_without_outliers(rows), path.name)


def _without_outliers(rows: Rows) -> tuple[Rows, int]:
    """The messages without single ones of another time, and how many those were."""
    kept, count = defaultdict(list, rows), 0
    for kind, of_kind in rows.items():
        if of_kind and "TimeUS" in of_kind[0]:
            keep = in_order(np.array([int(row["TimeUS"]) for row in of_kind], np.int64) * 1000)
            kept[kind] = [row for row, fits in zip(of_kind, keep.tolist(), strict=True) if fits]
            count += len(of_kind) - len(kept[kind])
    return kept, count


def _advancing(reader: Any) -> Any:
    """The class of a reader that raises ValueError where a message takes no bytes.

    A damaged log may state so of a type of message; pymavlink would then read the same message for ever.
    """

    class Advancing(reader):  # type: ignore[misc]
        def recv_msg(self) -> Any:
            before = self.offset
            message = super().recv_msg()
            if message is not None and self.offset <= before:
                raise ValueError(f"a message without length at byte {self.offset}")
            return message

    return Advancing


def _rows(log: Any) -> Rows:
    """The messages that are needed, by type, in the log's order."""
    rows: Rows = defaultdict(list)
    while True:
        message = log.recv_match(type=_WANTED)
        if message is None:
            return rows
        fields = message.to_dict()
        rows[fields.pop("mavpackettype")].append(fields)


def _converted(rows: Rows, left_out: int, name: str) -> AutopilotLog:
    parameters = {row["Name"]: float(row["Value"]) for row in rows["PARM"]}
    outputs = _outputs(rows)
    controls, remarks = control_commands(outputs, parameters)
    unmapped, remedies = remarks, _remedies(parameters)
    imu, attitude = _imu(rows, parameters), _attitude(rows)
    density = _density(rows)
    if rows["AOA"]:
        remarks += ("AOA is computed from the attitude, not measured; it is not used",)
    return AutopilotLog(
        name=name,
        autopilot=_firmware(rows),
        imu=imu,
        attitude=attitude,
        airspeed=_airspeed(rows, density),
        density=density,
        controls=controls,
        outputs=outputs,
        flown=_flown(rows, int(imu.stamp_ns[-1]) if len(imu) else 0),
        remarks=remarks + said_of(left_out),
        remedies=remedies,
        lacks=_lacks(outputs, density, remedies),
        unmapped="; ".join(unmapped),
    )


def _lacks(outputs: LoggedCommands, density: Signal, remedies: Mapping[str, str]) -> dict[str, str]:
    lacking = {} if len(density) else {AIRSPEED: _NO_BARO}
    return lacking if len(outputs.signal) else {**lacking, CONTROLS: f"no RCOU in it; {remedies[CONTROLS]}"}


def _remedies(parameters: Mapping[str, float]) -> dict[str, str]:
    """What raises the rate of each signal: bits of LOG_BITMASK that are not set yet, or what else slows it down."""
    mask = int(parameters.get("LOG_BITMASK", 0))
    found = dict(_REMEDIES)
    if mask & 129 == 129:
        found[IMU] = "LOG_BITMASK has bits 0 and 7 set; raise SCHED_LOOP_RATE, or look for dropped messages (DSF.Dp)"
    if mask >> 13 & 1:
        found[CONTROLS] = "LOG_BITMASK has bit 13 (RC) set, which gives 25 Hz at most; look for dropped messages"
    return found


def _firmware(rows: Rows) -> str:
    texts = [str(row.get("Message", "")) for row in rows["MSG"]]
    found = next((text for text in texts if text.startswith(("Ardu", "APM:"))), "ArduPilot")
    return " ".join(found.split()[:2])


def _signal(rows: list[dict[str, Any]], source: str, columns: tuple[str, ...]) -> Signal:
    """Columns of the messages of one type as a signal, NaN for one that they lack."""
    if not rows:
        return absent(source, len(columns))
    stamps = np.array([int(row["TimeUS"]) if "TimeUS" in row else int(row["TimeMS"]) * 1000 for row in rows], np.int64)
    values = np.array([[_number(row.get(column)) for column in columns] for row in rows])
    return Signal(source, stamps * 1000, values)


def _number(value: Any) -> float:
    return float(value) if isinstance(value, (int, float)) else math.nan


def _primary_core(rows: Rows) -> int:
    """The lane of the estimator that was in use for longest: XKF4.PI, of older logs NKF4.PI."""
    lanes = [int(row["PI"]) for row in rows["XKF4"] or rows["NKF4"] if "PI" in row and row.get("C", 0) in (0, None)]
    return int(np.bincount(lanes).argmax()) if lanes and min(lanes) >= 0 else 0


def _imu(rows: Rows, parameters: dict[str, float]) -> Signal:
    """The IMU of the estimator's primary lane: the lane's number counts the bits of EK3_IMU_MASK."""
    columns = ("AccX", "AccY", "AccZ", "GyrX", "GyrY", "GyrZ")
    mask = int(parameters.get("EK3_IMU_MASK", parameters.get("EK2_IMU_MASK", 3)))
    places = [i for i in range(3) if mask >> i & 1] or [0]
    lane = _primary_core(rows)
    primary = places[lane] if lane < len(places) else places[0]
    if any("I" in row for row in rows["IMU"][:1]):
        chosen = [row for row in rows["IMU"] if row["I"] == primary] or rows["IMU"]
        several = {row["I"] for row in rows["IMU"][:100]}
        return _signal(chosen, f"IMU[{chosen[0]['I']}]" if len(several) > 1 else "IMU", columns)
    named = "IMU" if primary == 0 or not rows[f"IMU{primary + 1}"] else f"IMU{primary + 1}"
    return _signal(rows[named], named, columns)


def _attitude(rows: Rows) -> Signal:
    """Quaternions w x y z of ATT's Euler angles (deg)."""
    euler = _signal(rows["ATT"], "ATT", ("Roll", "Pitch", "Yaw"))
    return Signal("ATT", euler.stamp_ns, np.roll(quaternion_from_euler(np.radians(euler.values), "frd"), 1, axis=1))


def _density(rows: Rows) -> Signal:
    """Density of dry air from the static pressure and the temperature on the ground, less the standard lapse.

    The barometer's own thermometer is on a warm board, and is used where the ground's is not logged.
    """
    first = [row for row in rows["BARO"] if row.get("I", 0) == 0]
    baro = _signal(first, "BARO", ("Press", "GndTemp", "Temp", "Alt"))
    pressure, ground, board, height = baro.values.T
    celsius = np.where(np.nan_to_num(ground) != 0.0, ground - _LAPSE * height, board)
    density = pressure / (GAS_CONSTANT * (celsius + 273.15))
    return Signal("BARO", baro.stamp_ns, density[:, np.newaxis])


def _airspeed(rows: Rows, density: Signal) -> Signal:
    """True airspeed of the primary sensor: its equivalent airspeed over the root of the relative density."""
    chosen = rows["ARSP"]
    numbers = {row.get("I", 0) for row in chosen}
    if len(numbers) > 1:
        primary = [int(row["Pri"]) for row in chosen if "Pri" in row]
        wanted = int(np.bincount(primary).argmax()) if primary else 0
        chosen = [row for row in chosen if row["I"] == wanted] or chosen
    name = f"ARSP[{chosen[0]['I']}]" if len(numbers) > 1 else "ARSP"
    equivalent = _signal(chosen, name, ("Airspeed",))
    healthy = np.array([row.get("H", 1) != 0 for row in chosen], bool)
    equivalent.values[~healthy] = np.nan
    if not len(density):
        equivalent.values[:] = np.nan  # it is no true airspeed
    if not len(equivalent) or not len(density):
        return equivalent
    at = np.interp(equivalent.stamp_ns.astype(float), density.stamp_ns.astype(float), density.values[:, 0])
    return Signal(name, equivalent.stamp_ns, equivalent.values * np.sqrt(SEA_LEVEL_DENSITY / at)[:, np.newaxis])


def _outputs(rows: Rows) -> LoggedCommands:
    """The pulses (us) of all outputs, at the times of RCOU; later banks are taken at their last sample."""
    base = _signal(rows["RCOU"], "RCOU", ())
    names: list[str] = []
    columns: list[Array] = []
    for bank in ("RCOU", "RCO2", "RCO3"):
        numbers = _output_numbers(rows[bank])
        signal = _signal(rows[bank], bank, tuple(numbers))
        if len(signal):
            place = np.searchsorted(signal.stamp_ns, base.stamp_ns, side="right") - 1
            names += [f"out{number}" for number in numbers.values()]
            columns += list(signal.values[np.clip(place, 0, len(signal) - 1)].T)
    order = np.argsort([int(name[3:]) for name in names])
    values = np.column_stack(columns)[:, order] if columns else np.empty((0, 0))
    if [names[i] for i in order] != [f"out{i + 1}" for i in range(len(names))]:
        raise InputError("RCOU: the outputs are not numbered from 1 without a gap; the log is damaged")
    return LoggedCommands(tuple(names[i] for i in order), Signal("RCOU", base.stamp_ns, values))


def _output_numbers(rows: list[dict[str, Any]]) -> dict[str, int]:
    """The columns of outputs, C1 or in older logs Ch1 and Chan1, with their numbers."""
    found = {}
    for column in rows[0] if rows else ():
        digits = column.lstrip("Chan")
        if column.startswith("C") and digits.isdigit():
            found[column] = int(digits)
    return found


def _flown(rows: Rows, end_ns: int) -> Spans | None:
    """When STAT says that it flies, and the mode is none in which a QuadPlane hovers."""
    conditions = []
    for kind, column, holds in (
        ("STAT", "isFlying", lambda value: value != 0),
        ("MODE", "ModeNum", lambda value: int(value) not in _HOVERING),
    ):
        state = _signal([row for row in rows[kind] if column in row], kind, (column,))
        if len(state):
            flags = np.array([holds(value) for value in state.values[:, 0]], bool)
            conditions.append(Condition(state.stamp_ns, flags))
    flying = any("isFlying" in row for row in rows["STAT"][:1])
    return spans_where(conditions, end_ns) if flying else None
