"""Commands of the controls in a PX4 log, by the log's own parameters.

From 1.14 (and 1.13 with ``SYS_CTRL_ALLOC`` = 1) the surfaces are described by the parameters ``CA_SV_CS*``, and their
commands are in ``actuator_servos``. They are logged at 10 Hz by default, but ``vehicle_torque_setpoint``, from which
PX4 computes them linearly, at 50 Hz. Where the torque reproduces the logged servos, it is used between their samples.
Before 1.14 a mixer file describes the surfaces, which the log does not hold; but the commands before the mixer,
``actuator_controls_0`` (a VTOL's as a fixed wing: ``actuator_controls_1``), are those of the axes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from sysid_node.flight.logs.autopilot_log import LoggedCommands, Signal, absent
from sysid_node.flight.logs.readers.mixing import AXES, SIGNS, at_full_stick, unmixed
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Stamps

#: Kinds of surfaces by the value of CA_SV_CSn_TYPE (PX4, ``control_allocator`` module.yaml).
_KINDS = {
    1: "left aileron",
    2: "right aileron",
    3: "elevator",
    4: "rudder",
    5: "left elevon",
    6: "right elevon",
    7: "left V-tail",
    8: "right V-tail",
    13: "left A-tail",
    14: "right A-tail",
    15: "aileron",
}
_FLAPS = (9, 10)

#: Flaps, airbrakes, a steered wheel and spoilers, whose torques PX4 takes as zero.
_WITHOUT_TORQUE = (9, 10, 11, 16, 17, 18)

#: The torque reproduces the servos where four errors of five are below this share of the servos' standard deviation.
_REPRODUCED = 0.1

#: The servos are compared with the torque at so many samples or more.
_FEWEST = 20

#: Gains of the mixer below this are rounding.
_NO_GAIN = 1e-3

#: The function that PX4 assigns to the first servo (PWM_MAIN_FUNCn = 201).
_FIRST_SERVO = 201

Parameters = Mapping[str, float]
Topic = Callable[[str, tuple[str, ...]], Signal]


def control_commands(topic: Topic, parameters: Parameters, *, vtol: bool) -> tuple[LoggedCommands, tuple[str, ...]]:
    """The controls' fractions of full command, and remarks. ``topic`` gives the columns of a topic as a signal."""
    count = int(parameters.get("CA_SV_CS_COUNT", 0))
    servos = topic("actuator_servos", tuple(f"control[{i}]" for i in range(max(count, 1))))
    if count and not len(servos):
        servos = _servos_of_pulses(topic, parameters, count)
    if count and len(servos):
        return _from_servos(topic, parameters, servos, vtol=vtol)
    if count:
        remark = "no actuator_servos in it, and no PWM_MAIN_FUNCn or PWM_AUX_FUNCn of actuator_outputs names each servo"
        return LoggedCommands((), absent("actuator_servos", 0)), (remark,)
    return _from_axes(topic, vtol=vtol)


def _from_servos(
    topic: Topic, parameters: Parameters, servos: Signal, *, vtol: bool
) -> tuple[LoggedCommands, tuple[str, ...]]:
    kinds = [int(parameters.get(f"CA_SV_CS{i}_TYPE", 0)) for i in range(servos.values.shape[1])]
    full = _full_stick(parameters, kinds)
    used = np.flatnonzero(full.any(axis=1))
    if not used.size:
        return LoggedCommands((), absent("actuator_servos", 0)), ("CA_SV_CS*_TYPE name no surface that moves an axis",)
    names, fractions = unmixed(full[used], servos.values[:, used])
    signal = Signal(servos.source, servos.stamp_ns, fractions)
    signal, remarks = _refined(signal, topic, names, vtol=vtol)
    flaps = [i for i, kind in enumerate(kinds) if kind in _FLAPS]
    if flaps:
        flap = _last_values(servos, np.mean(servos.values[:, flaps], axis=1), signal.stamp_ns)
        names, signal = (*names, "flap"), _with_column(signal, flap)
    throttle = _throttle(topic, parameters, signal.stamp_ns)
    if throttle is not None:
        names, signal = (*names, "throttle"), _with_column(signal, throttle)
    return LoggedCommands(names, signal), remarks


def _full_stick(parameters: Parameters, kinds: Sequence[int]) -> Array:
    """The commands (S, 3) to the surfaces at full stick in roll, pitch and yaw, of the surfaces' ``kinds`` (S,).

    PX4 computes the commands of a fixed wing by the pseudo-inverse of the torques CA_SV_CSn_TRQ_*, which it does not
    normalise (``ControlAllocationPseudoInverse``, ``ActuatorEffectiveness::getNormalizeRPY``), and limits them to 1.
    Surfaces of a known kind count for their own axes alone: an aileron's small torque in yaw does not make it a rudder.
    Where the log states no torques, full stick is the full travel.
    """
    usual = np.array([SIGNS.get(_KINDS.get(kind, ""), (0, 0, 0)) for kind in kinds], float)
    torques = np.array([[parameters.get(f"CA_SV_CS{i}_TRQ_{axis}", 0.0) for axis in "RPY"] for i in range(len(kinds))])
    stated = torques.any(axis=1) & ~np.isin(kinds, _WITHOUT_TORQUE)
    gains = np.linalg.pinv(torques[stated].T, rcond=1e-6)
    gains[np.abs(gains) < _NO_GAIN] = 0.0
    known = np.array([kind in _KINDS for kind in kinds])[stated, np.newaxis]
    full = usual.copy()
    full[stated] = np.where(known & (usual[stated] == 0.0), 0.0, at_full_stick(gains))
    return full


def _refined(servos: Signal, topic: Topic, names: tuple[str, ...], *, vtol: bool) -> tuple[Signal, tuple[str, ...]]:
    """The commands at the rate of the torque setpoint, where this is faster and reproduces them."""
    columns = tuple(f"xyz[{AXES.index(name)}]" for name in names)
    torque = topic("vehicle_torque_setpoint/1" if vtol else "vehicle_torque_setpoint", columns)
    if len(servos) < _FEWEST or len(torque) < 1.5 * len(servos):
        return servos, ()
    at_servos = _interpolated(torque, servos.stamp_ns)
    inside = np.isfinite(at_servos).all(axis=1) & np.isfinite(servos.values).all(axis=1)
    if np.count_nonzero(inside) < _FEWEST:  # the torque was logged at another time
        return servos, ()
    fine = np.empty((len(torque), len(names)))
    for i in range(len(names)):
        design = np.column_stack([at_servos[inside, i], np.ones(int(inside.sum()))])
        outputs = servos.values[inside, i]
        coefficients = np.linalg.lstsq(design, outputs, rcond=None)[0]
        errors = np.abs(outputs - design @ coefficients)  # large where a step falls between two samples of the torque
        if float(np.quantile(errors, 0.8)) > _REPRODUCED * float(np.std(outputs)) + 1e-4:
            return servos, ("vehicle_torque_setpoint does not reproduce actuator_servos and is not used",)
        fine[:, i] = coefficients[0] * torque.values[:, i] + coefficients[1]
    remark = f"servos: vehicle_torque_setpoint reproduces actuator_servos ({len(servos)} samples) and stands for them"
    return Signal("vehicle_torque_setpoint", torque.stamp_ns, np.clip(fine, -1.0, 1.0)), (remark,)


def _throttle(topic: Topic, parameters: Parameters, at_ns: Stamps) -> Array | None:
    """The mean command (0..1) of the motors that pull or push forwards, at the times; None where none is logged."""
    rotors = max(int(parameters.get("CA_ROTOR_COUNT", 1)), 1)
    forward = [i for i in range(rotors) if parameters.get(f"CA_ROTOR{i}_AX", 0.0) > 0.5]
    if int(parameters.get("CA_AIRFRAME", 1)) == 1:  # a fixed wing, whose motors all act forwards
        forward = list(range(rotors))
    motors = topic("actuator_motors", tuple(f"control[{i}]" for i in forward or [0]))
    if not len(motors) or not forward:
        return None
    return _last_values(motors, np.nan_to_num(motors.values).mean(axis=1), at_ns)  # PX4 stops a motor by NaN


def _servos_of_pulses(topic: Topic, parameters: Parameters, count: int) -> Signal:
    """The servos' commands -1..1 from the pulses of actuator_outputs, by PWM_*_FUNC, _MIN, _MAX and _REV.

    They are at the times of the bank with most servos; of the other bank the last samples before are taken.
    """
    servos = [_servo_of_pulses(topic, parameters, i) for i in range(count)]
    found = [servo for servo in servos if servo is not None]
    if len(found) < count:
        return absent("actuator_servos", count)
    sizes = [sum(other.source == servo.source for other in found) for servo in found]
    base = found[sizes.index(max(sizes))].stamp_ns
    columns = [_last_values(servo, servo.values[:, 0], base) for servo in found]
    return Signal("actuator_outputs", base, np.column_stack(columns))


def _servo_of_pulses(topic: Topic, parameters: Parameters, number: int) -> Signal | None:
    """The commands (N, 1) of a servo, counted from 0; None where no output that was logged is its own."""
    for instance, bank in enumerate(("MAIN", "AUX")):
        place = _output_of(parameters, bank, _FIRST_SERVO + number)
        if place < 0:
            continue
        pulses = topic(f"actuator_outputs/{instance}" if instance else "actuator_outputs", (f"output[{place}]",))
        low = parameters.get(f"PWM_{bank}_MIN{place + 1}", 1000.0)
        high = parameters.get(f"PWM_{bank}_MAX{place + 1}", 2000.0)
        sign = -1.0 if int(parameters.get(f"PWM_{bank}_REV", 0)) >> place & 1 else 1.0
        fractions = sign * (2.0 * (pulses.values - low) / (high - low) - 1.0)
        if len(pulses):
            return Signal(bank, pulses.stamp_ns, np.clip(fractions, -1.0, 1.0))
    return None


def _output_of(parameters: Parameters, bank: str, function: int) -> int:
    found = (i for i in range(16) if int(parameters.get(f"PWM_{bank}_FUNC{i + 1}", 0)) == function)
    return next(found, -1)


def _from_axes(topic: Topic, *, vtol: bool) -> tuple[LoggedCommands, tuple[str, ...]]:
    """The commands before the mixer of PX4 before 1.14: roll, pitch, yaw, thrust."""
    name = "actuator_controls_1" if vtol else "actuator_controls_0"
    commands = topic(name, tuple(f"control[{i}]" for i in range(4)))
    values = commands.values * np.array([-1.0, -1.0, -1.0, 1.0])
    names = (*AXES, "throttle") if len(commands) else ()
    return LoggedCommands(names, Signal(name, commands.stamp_ns, values)), ()


def _last_values(signal: Signal, values: Array, at_ns: Stamps) -> Array:
    """Values (N,) at other times: the last one of before."""
    place = np.searchsorted(signal.stamp_ns, at_ns, side="right") - 1
    last_values: Array = values[np.clip(place, 0, values.size - 1)]
    return last_values


def _interpolated(signal: Signal, at_ns: Stamps) -> Array:
    """The signal at other times, NaN outside of it."""
    origin = int(signal.stamp_ns[0])
    at, known = (at_ns - origin) / 1e9, (signal.stamp_ns - origin) / 1e9
    columns = [np.interp(at, known, column, left=np.nan, right=np.nan) for column in signal.values.T]
    return np.column_stack(columns)


def _with_column(signal: Signal, column: Array) -> Signal:
    return Signal(signal.source, signal.stamp_ns, np.column_stack([signal.values, column]))
