"""The same simulated flight as PX4 and as ArduPilot would log it, at the rates that a test asks for."""

import datetime
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from dataflash_file import write_dataflash, write_dataflash_text
from ulog_file import Topic, write_ulog

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.frames import quaternion_from_euler
from sysid_node.flight.logs.opening import load_flight_record
from sysid_node.flight.record import FlightRecord

BAG = Path(__file__).resolve().parents[3] / "bags" / "cdrw_multistep"

#: Deflection at full command, rad, and the pulses of ArduPilot's outputs for aileron, elevator, throttle, rudder.
FULL = {"elevator": 0.4, "aileron": 0.35, "rudder": -0.5}
SERVOS = {
    1: (4, 1100, 1900, 1500, 0),
    2: (19, 1000, 2000, 1480, 1),
    3: (70, 1000, 2000, 1500, 0),
    4: (21, 900, 2100, 1500, 0),
}
MAX_THRUST = 30.0

#: The outputs of other aircraft: a flying wing with a rudder, and a V-tail; of each pair one output is reversed.
LAYOUTS = {
    "ailerons": SERVOS,
    "elevons": {**SERVOS, 1: (77, 1100, 1900, 1500, 0), 2: (78, 1000, 2000, 1480, 1)},
    "V-tail": {**SERVOS, 2: (79, 1000, 2000, 1480, 1), 4: (80, 900, 2100, 1500, 0)},
}

Rates = Mapping[str, float]
FULL_RATES = {"imu": 100.0, "attitude": 100.0, "airspeed": 50.0, "air": 20.0, "controls": 100.0}
PX4_DEFAULT = {"imu": 100.0, "attitude": 20.0, "airspeed": 5.0, "air": 5.0, "controls": 10.0}


def aircraft() -> Aircraft:
    """The flight's aircraft, with the deflections at full command."""
    made = load_aircraft("cdrw")
    controls = {name: replace(control, full_deflection=FULL[name]) for name, control in made.controls.items()}
    return replace(made, controls=controls)


@cache
def flight() -> FlightRecord:
    """20 s of the bundled flight, with its attitude."""
    return load_flight_record(BAG, load_aircraft("cdrw")).between(2.0, 22.0)


def fractions(record: FlightRecord) -> np.ndarray:
    """Torque-like commands (N, 4): roll, pitch, yaw and throttle, as an autopilot has them."""
    surfaces = zip(("da", "de", "dr"), ("aileron", "elevator", "rudder"), strict=True)
    return np.column_stack(
        [*(-record[symbol] / FULL[name] for symbol, name in surfaces), record["thrust"] / MAX_THRUST]
    )


def picked(record: FlightRecord, rate: float) -> np.ndarray:
    """Places of the samples that a logger keeps at a rate."""
    step = max(round(1.0 / rate / float(np.median(np.diff(record.time)))), 1)
    return np.arange(0, len(record), step)


def microseconds(record: FlightRecord) -> np.ndarray:
    return np.round((record.time + 100.0) * 1e6).astype(np.int64)


def px4_log(
    path: Path,
    rates: Rates = FULL_RATES,
    *,
    old: bool = False,
    elevons: bool = False,
    drop: tuple[str, ...] = (),
    vehicle_type: int = 2,
    jump: float = 0.0,
    torque: float = 0.0,
    start: datetime.datetime | None = None,
    vehicle: str = "",
    vanes: Mapping[str, tuple[float, float]] | None = None,
    aloft: tuple[float, float] | None = None,
    pulses: str = "",
    blocked: tuple[float, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    slow_outputs: float = 0.0,
) -> FlightRecord:
    """A ULog of the flight, of PX4 1.11 where ``old``; without ``drop``, its clock ``jump`` s ahead from midway.

    ``torque``: rate of the torque setpoint, Hz, from which PX4 computes the servos linearly. ``start`` is the date that
    its GPS receiver states, and ``vehicle`` the autopilot's number. ``vanes`` are "aoa" and "slip" with the time (s)
    between which each is out of its range, and ``aloft`` those between which the aircraft flies.
    ``pulses``: the bank, MAIN or AUX, whose pulses are logged in place of the servos' commands. ``blocked``: the times
    (s) between which the airspeed sensor, logged at 50 Hz too, is blocked and not used by PX4.
    ``parameters`` replace those that the log would hold. ``slow_outputs``: a rate, Hz, at which the pulses of outputs
    that stand still are logged, too.
    """
    record = flight()
    us = microseconds(record)
    middle = int(us[us.size // 2])
    at = {name: picked(record, rate) for name, rate in rates.items()}
    topics = [
        *_px4_motion(record, us, at, old=old),
        *_px4_status(us, vehicle_type),
        *_px4_controls(us[at["controls"]], fractions(record)[at["controls"]], old=old, elevons=elevons),
        *(_vane(record, at["airspeed"], name, span) for name, span in (vanes or {}).items()),
    ]
    stated = {} if old else _px4_parameters(elevons=elevons)
    if blocked is not None:
        topics = [topic for topic in topics if topic.name != "airspeed_validated"]
        topics += _blocked_sensor(record, at["airspeed"], blocked)
    if slow_outputs:
        still = picked(record, slow_outputs)
        pulses_held = {"output[16]": ("float", np.full((still.size, 16), 1500.0))}
        topics.append(Topic("actuator_outputs", us[still], pulses_held))
    if pulses:
        topics, of_pulses = _as_pulses(topics, pulses)
        stated |= of_pulses
    if aloft is not None:
        times = us[0] + np.round(np.array([0.0, *aloft]) * 1e6).astype(np.int64)
        landed = {"landed": ("bool", np.array([True, False, True]))}
        topics = [topic for topic in topics if topic.name != "vehicle_land_detected"]
        topics.append(Topic("vehicle_land_detected", times, landed))
    if torque:
        fine = picked(record, torque)
        scaled = fractions(record)[fine][:, :3] * np.array([0.5, 0.8, 1.2])
        topics.append(Topic("vehicle_torque_setpoint", us[fine], {"xyz[3]": ("float", scaled)}))
    if start is not None:
        utc = {"time_utc_usec": ("uint64_t", np.array([round(start.timestamp() * 1e6)]))}
        topics.append(Topic("sensor_gps", us[:1], utc))
    kept = [topic for topic in topics if topic.name not in drop]
    release = 0x010B0200 if old else 0x010E0000
    jumping = (lambda time: time + (round(jump * 1e6) if time > middle else 0)) if jump else None
    write_ulog(path, kept, stated | dict(parameters or {}), release, jumping, vehicle)
    return record


def _px4_motion(record: FlightRecord, us: np.ndarray, at: Mapping[str, np.ndarray], *, old: bool) -> list[Topic]:
    """IMU, attitude and air data, at the stamps ``us`` of the samples ``at`` which each topic keeps."""
    motion = np.column_stack([record[name] for name in ("p", "q", "r", "ax", "ay", "az")])[at["imu"]]
    euler = np.column_stack([record[name] for name in ("phi", "theta", "psi")])[at["attitude"]]
    wxyz = np.roll(quaternion_from_euler(euler, "frd"), 1, axis=1)
    speed, rho = record["V"][at["airspeed"]], record["rho"][at["air"]]
    return [
        Topic("sensor_combined", us[at["imu"]], {
            "gyro_rad[3]": ("float", motion[:, :3]),
            "accelerometer_timestamp_relative": ("int32_t", np.zeros(len(motion), int)),
            "accelerometer_m_s2[3]": ("float", motion[:, 3:]),
        }),
        Topic("vehicle_attitude", us[at["attitude"]], {"q[4]": ("float", wxyz)}),
        Topic("airspeed_validated", us[at["airspeed"]], {
            "true_airspeed_m_s": ("float", speed),
            "selected_airspeed_index" if old else "airspeed_source": ("int8_t", np.ones(speed.size, int)),
        }),
        Topic("vehicle_air_data", us[at["air"]], {"rho": ("float", rho)}),
    ]  # fmt: skip


def _px4_status(us: np.ndarray, vehicle_type: int) -> list[Topic]:
    """An armed vehicle of this type in the air."""
    return [
        Topic("vehicle_status", us[:1], {
            "arming_state": ("uint8_t", np.array([2])), "vehicle_type": ("uint8_t", np.array([vehicle_type])),
            "is_vtol": ("bool", np.array([False])), "in_transition_mode": ("bool", np.array([False])),
        }),
        Topic("vehicle_land_detected", us[:1], {"landed": ("bool", np.array([False]))}),
    ]  # fmt: skip


#: Outputs of servos 1 to 4: their number, shortest and longest pulse (us), and whether they are reversed.
PWM = ((3, 1000, 2000, False), (1, 1100, 1900, True), (8, 950, 2050, False), (6, 900, 2100, True))


def _as_pulses(topics: list[Topic], bank: str) -> tuple[list[Topic], dict[str, float]]:
    """The topics with actuator_outputs in place of actuator_servos, and the parameters PWM_* of the bank."""
    (servos,) = (topic for topic in topics if topic.name == "actuator_servos")
    commands = servos.fields["control[8]"][1]
    outputs = np.zeros((len(servos.us), 16))
    parameters: dict[str, float] = {f"PWM_{bank}_REV": sum(1 << number - 1 for number, *_, turned in PWM if turned)}
    for i, (number, low, high, turned) in enumerate(PWM):
        signed = -commands[:, i] if turned else commands[:, i]
        outputs[:, number - 1] = low + 0.5 * (1.0 + signed) * (high - low)
        parameters[f"PWM_{bank}_FUNC{number}"] = 201 + i
        parameters |= {f"PWM_{bank}_MIN{number}": low, f"PWM_{bank}_MAX{number}": high}
    others = [topic for topic in topics if topic.name != "actuator_servos"]
    fields = {"output[16]": ("float", outputs)}
    instances = [Topic("actuator_outputs", servos.us, fields, 0)]
    if bank == "AUX":
        idle = {"output[16]": ("float", np.full((len(servos.us), 16), 1500.0))}
        instances = [Topic("actuator_outputs", servos.us, idle, 0), Topic("actuator_outputs", servos.us, fields, 1)]
    return [*others, *instances], parameters


def _vane(record: FlightRecord, at: np.ndarray, name: str, span: tuple[float, float]) -> Topic:
    """A vane's topic: in the time between the two of the span (s from the start) it is at its stop, and not valid."""
    since = record.time[at] - record.time[0]
    valid = (since < span[0]) | (since >= span[1])
    angle = np.where(valid, record[{"aoa": "alpha", "slip": "beta"}[name]][at], 1.0)
    fields = {f"{name}_rad": ("float", angle), "valid": ("bool", valid)}
    return Topic(f"airflow_{name}", microseconds(record)[at], fields)


def _blocked_sensor(record: FlightRecord, at: np.ndarray, span: tuple[float, float]) -> list[Topic]:
    """The validated airspeed, and the sensor's, 10 % lower and 7 m/s in the time between the two of the span (s)."""

    def out(places: np.ndarray) -> np.ndarray:
        since = record.time[places] - record.time[0]
        return (since >= span[0]) & (since < span[1])

    fine = picked(record, 50.0)
    raw = np.where(out(fine), 7.0, record["V"][fine] / 1.1)
    return [
        Topic("airspeed_validated", microseconds(record)[at], {
            "true_airspeed_m_s": ("float", record["V"][at]), "airspeed_source": ("int8_t", np.where(out(at), 0, 1)),
        }),
        Topic("airspeed", microseconds(record)[fine], {"true_airspeed_m_s": ("float", raw)}),
    ]  # fmt: skip


def _px4_controls(us: np.ndarray, commands: np.ndarray, *, old: bool, elevons: bool) -> list[Topic]:
    roll, pitch, yaw, thrust = commands.T
    if old:
        return [Topic("actuator_controls_0", us, {"control[8]": ("float", np.pad(commands, ((0, 0), (0, 4))))})]
    surfaces = [pitch - roll, pitch + roll, yaw] if elevons else [-roll, roll, pitch, yaw]
    servos = np.column_stack([*surfaces, *[np.full(roll.size, np.nan)] * (8 - len(surfaces))])
    motors = np.column_stack([thrust, *[np.full(roll.size, np.nan)] * 11])
    return [
        Topic("actuator_servos", us, {"control[8]": ("float", servos)}),
        Topic("actuator_motors", us, {"control[12]": ("float", motors)}),
    ]


def _px4_parameters(*, elevons: bool) -> dict[str, float]:
    kinds = (5, 6, 4) if elevons else (1, 2, 3, 4)
    torques = {
        1: (-0.5, 0.0, 0.0), 2: (0.5, 0.0, 0.0), 3: (0.0, 1.0, 0.0), 4: (0.0, 0.0, 1.0),
        5: (-0.5, 0.5, 0.0), 6: (0.5, 0.5, 0.0),
    }  # fmt: skip
    parameters: dict[str, float] = {"CA_AIRFRAME": 1, "CA_ROTOR_COUNT": 1, "CA_SV_CS_COUNT": len(kinds)}
    for i, kind in enumerate(kinds):
        parameters[f"CA_SV_CS{i}_TYPE"] = kind
        parameters |= {f"CA_SV_CS{i}_TRQ_{axis}": value for axis, value in zip("RPY", torques[kind], strict=True)}
    return parameters


def dataflash_log(
    path: Path,
    rates: Rates = FULL_RATES,
    *,
    firmware: str = "ArduPlane V4.5.0",
    flying: int = 1,
    start: datetime.datetime | None = None,
    board: str = "",
    layout: str = "ailerons",
    mixing: Mapping[str, float] | None = None,
    text: bool = False,
    drop: tuple[str, ...] = (),
    jump: float = 0.0,
    states: Mapping[str, list[tuple[float, int]]] | None = None,
    more: Mapping[str, float] | None = None,
) -> FlightRecord:
    """A DataFlash log of the flight, with a second IMU that is wrong and not the primary.

    ``text`` writes it as text; ``drop`` leaves kinds of messages out, and from midway its clock is ``jump`` s ahead.
    ``states`` are those of "STAT" (isFlying) and "MODE" (its number) from some times on, s.
    ``more`` are other parameters.
    ``layout`` is one of ``LAYOUTS``, and ``mixing`` the parameters MIXING_*, of which a log without them has none.
    ``start`` is the GPS receiver's time at the first message and ``board`` the line with the board's number.
    """
    record = flight()
    us = microseconds(record).tolist()
    at = {name: picked(record, rate) for name, rate in rates.items()}
    motion = np.column_stack([record[name] for name in ("p", "q", "r", "ax", "ay", "az")])
    degrees = np.degrees(np.column_stack([record[name] for name in ("phi", "theta", "psi")]))
    equivalent = record["V"] * np.sqrt(record["rho"] / 1.225)
    pulses = pulses_of(fractions(record), layout, mixing or {})
    parameters = {**_ardupilot_parameters(layout), **(mixing or {}), **(more or {})}
    kelvin = 288.15
    rows = {
        "MSG": [(us[0], f"{firmware} (abcd)"), *([(us[0], board)] if board else [])],
        "GPS": [] if start is None else [(us[0], *_gps_time(start))],
        "PARM": [(us[0], name, value) for name, value in parameters.items()],
        "STAT": [(us[0], flying, 1)],
        "MODE": [(us[0], 5, 5)],
        "XKF4": [(us[0], 0, 1)],
        "IMU": [
            row
            for i in at["imu"]
            for row in ((us[i], 0, *(5.0 * motion[i])), (us[i], 1, *motion[i]))
        ],
        "ATT": [(us[i], *degrees[i]) for i in at["attitude"]],
        "ARSP": [(us[i], 0, equivalent[i], 1, 0) for i in at["airspeed"]],
        "BARO": [(us[i], 0, 0.0, record["rho"][i] * 287.05287 * kelvin, 45.0, kelvin - 273.15) for i in at["air"]],
        "RCOU": [(us[i], *pulses[i].tolist(), 0, 0) for i in at["controls"]],
        "AOA": [(us[i], 3.0, 0.1) for i in at["airspeed"]],
    }  # fmt: skip
    for kind, changes in (states or {}).items():
        rows[kind] = [(us[0] + round(since * 1e6), value, 1 if kind == "STAT" else value) for since, value in changes]
    kept = {kind: of_kind for kind, of_kind in rows.items() if kind not in drop}
    middle, later = us[len(us) // 2], round(jump * 1e6)
    write = write_dataflash_text if text else write_dataflash
    write(path, kept, lambda time: time + (later if time > middle else 0))
    return record


def _gps_time(date: datetime.datetime) -> tuple[int, int]:
    """Milliseconds of the week, and the week, of GPS time, which is 18 s ahead of UTC."""
    seconds = (date - datetime.datetime(1980, 1, 6, tzinfo=datetime.UTC)).total_seconds() + 18.0
    return round(1e3 * (seconds % 604800)), int(seconds // 604800)


def mixed(commands: np.ndarray, layout: str, mixing: Mapping[str, float]) -> np.ndarray:
    """Scaled outputs 1 to 4 (N, 4) from roll, pitch, yaw and throttle, by ArduPlane's ``channel_function_mixer``."""
    roll, pitch, yaw, throttle = commands.T
    other = yaw if layout == "V-tail" else roll
    gain, offset = mixing.get("MIXING_GAIN", 0.5), mixing.get("MIXING_OFFSET", 0.0)
    first = other * (100 + offset) * 0.01 if offset > 0 else other
    second = pitch * (100 - offset) * 0.01 if offset < 0 else pitch
    less, more = (np.clip(gain * (second + sign * first), -1.0, 1.0) for sign in (-1, 1))
    columns = {
        "ailerons": [roll, pitch, throttle, yaw],
        "elevons": [less, more, throttle, yaw],
        "V-tail": [roll, more, throttle, less],
    }
    return np.column_stack(columns[layout])


def pulses_of(commands: np.ndarray, layout: str = "ailerons", mixing: Mapping[str, float] | None = None) -> np.ndarray:
    """Pulses (N, 4), us, of the outputs 1 to 4, as ArduPilot computes them from roll, pitch, yaw and throttle."""
    columns = []
    for number, command in zip((1, 2, 3, 4), mixed(commands, layout, mixing or {}).T, strict=True):
        function, low, high, trim, turned = LAYOUTS[layout][number]
        if function == 70:
            columns.append(low + command * (high - low))
        else:
            signed = -command if turned else command
            columns.append(trim + signed * np.where(signed > 0, high - trim, trim - low))
    return np.round(np.column_stack(columns)).astype(int)


def _ardupilot_parameters(layout: str) -> dict[str, float]:
    keys = ("FUNCTION", "MIN", "MAX", "TRIM", "REVERSED")
    rows = LAYOUTS[layout].items()
    return {f"SERVO{n}_{key}": float(value) for n, row in rows for key, value in zip(keys, row, strict=True)}
