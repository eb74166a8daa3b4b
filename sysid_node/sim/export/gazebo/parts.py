"""Masses, surfaces with their servos, and the rotor of a Gazebo model. Gazebo's axes are forward-left-up."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.sim.export.cells import finite, plain
from sysid_node.sim.export.folding import Effects, thrust_factor
from sysid_node.sim.export.servos import first_order_lags, second_order_line
from sysid_node.sim.export.steady import SteadyModel

Array = NDArray[np.float64]

#: Mass (kg) and moment of inertia (kg m^2) of a surface or the rotor, as in PX4's models: too little to matter, enough
#: for the physics engine.
_SMALL_MASS, _SMALL_INERTIA = 1e-8, 1e-6

#: Damping of a surface's joint, N m s: with it a gain of 1 / tau is a lag of tau.
_DAMPING = 1.0

#: Speed of the rotor at full thrust, rad/s: any value does, for thrust is the share of full thrust times the latter.
_ROTOR_SPEED = 1000.0

#: The largest command of a joint's controller that gz-sim takes for none.
_NO_LIMIT = 1000.0


@dataclass(frozen=True)
class SmallBody:
    """Mass (kg), moment of inertia (kg m^2) and place (m, forward-left-up) of a surface or rotor."""

    mass: float = _SMALL_MASS
    inertia: float = _SMALL_INERTIA
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)


def small_inertia(aircraft: Aircraft) -> float:
    """The moment of inertia (kg m^2) of a surface, in a very small aircraft too."""
    return min(_SMALL_INERTIA, 1e-4 * aircraft.inertia.Ixx)


def add_masses(link: Element, aircraft: Aircraft, shift: Mapping[str, float], others: Sequence[SmallBody]) -> None:
    """Mass and inertia of the link, so that the whole model has the aircraft's about its centre of gravity.

    Forward-left-up, the tensor's xz entry is the usual Ixz itself. ``shift`` is that of the centre of gravity (m).
    """
    inertia = aircraft.inertia
    place = (shift.get("x", 0.0), -shift.get("y", 0.0), -shift.get("z", 0.0))
    inertial = SubElement(link, "inertial")
    if any(place):
        SubElement(inertial, "pose").text = _pose(place)
    SubElement(inertial, "mass").text = _text(aircraft.mass - sum(body.mass for body in others))
    tensor = SubElement(inertial, "inertia")
    off = sum(body.inertia for body in others)
    for tag, value in {"ixx": inertia.Ixx - off, "ixy": 0.0, "ixz": inertia.Ixz, "iyy": inertia.Iyy - off, "iyz": 0.0,
                       "izz": inertia.Izz - off}.items():  # fmt: skip
        SubElement(tensor, tag).text = _text(value)


def joint_angles(aircraft: Aircraft, x: Mapping[str, Array]) -> dict[str, Array]:
    """Angles of the joints (N,), rad, that give deflections by symbol: the smallest that do."""
    joints = sorted({joint for control in aircraft.controls.values() for joint in control.joints})
    if not joints:
        return {}
    controls = list(aircraft.controls.values())
    mixing = np.array([[control.joints.get(joint, 0.0) for joint in joints] for control in controls])
    angles = np.linalg.pinv(mixing) @ np.array([x[control.symbol] for control in controls])
    return dict(zip(joints, angles, strict=True))


def add_servos(root: Element, aircraft: Aircraft, effects: Effects) -> list[SmallBody]:
    """A link, a joint and a controller for every joint of a surface.

    A lag is a gain against the joint's damping, and a rate limit the gain's largest command; without a lag the joint
    follows at once, or at its largest rate.
    """
    bodies = []
    inertia = small_inertia(aircraft)
    for joint, (lag, rate, limit, axis) in _servo_of_joints(aircraft, effects).items():
        body = SmallBody(inertia=inertia)
        link = f"{plain(joint)}_surface"
        _small_link(root, link, body)
        element = SubElement(root, "joint", name=plain(joint), type="revolute")
        SubElement(element, "parent").text = "base_link"
        SubElement(element, "child").text = link
        turning = SubElement(element, "axis")
        SubElement(turning, "xyz").text = axis
        if limit is not None:
            ends = SubElement(turning, "limit")
            SubElement(ends, "lower").text, SubElement(ends, "upper").text = _text(-limit), _text(limit)
        SubElement(SubElement(turning, "dynamics"), "damping").text = _text(_DAMPING)
        name = "gz::sim::systems::JointPositionController"
        plugin = SubElement(root, "plugin", filename="gz-sim-joint-position-controller-system", name=name)
        SubElement(plugin, "joint_name").text = plain(joint)
        SubElement(plugin, "sub_topic").text = plain(joint)
        most = rate * (_DAMPING if lag else 1.0) if rate else _NO_LIMIT
        entries: dict[str, float] = {"cmd_max": most, "cmd_min": -most}
        if lag:
            entries = {"p_gain": _DAMPING / lag, "i_gain": 0.0, "d_gain": 0.0, **entries}
        else:
            SubElement(plugin, "use_velocity_commands").text = "true"
        for tag, value in entries.items():
            SubElement(plugin, tag).text = _text(value)
        bodies.append(body)
    return bodies


def _servo_of_joints(aircraft: Aircraft, effects: Effects) -> dict[str, tuple[float, float, float | None, str]]:
    """Lag (s), rate limit (rad/s, 0: none), largest angle (rad) and axis of every joint, by the controls it serves."""
    lags = first_order_lags(effects)
    rates = {name: rate for name, rate in effects.get("actuator_rate_limit", {}).items() if math.isfinite(rate)}
    found: dict[str, tuple[float, float, float | None, str]] = {}
    for joint in dict.fromkeys(joint for control in aircraft.controls.values() for joint in control.joints):
        served = [c for c in aircraft.controls.values() if joint in c.joints]
        lag = sum(lags.get(c.name, 0.0) for c in served) / len(served)
        reach = {c.symbol: np.ones(1) * (1.0 if c in served else 0.0) * (c.limit or 0.0) for c in served}
        zeros = {symbol: np.zeros(1) for symbol in aircraft.control_symbols}
        parts = [abs(float(joint_angles(aircraft, {**zeros, symbol: value})[joint][0])) for symbol, value in
                 reach.items()]  # fmt: skip
        limit = sum(parts) if all(c.limit is not None for c in served) else None
        rate = max((rates[c.name] * abs(_per_unit(aircraft, c.symbol, joint)) for c in served if c.name in rates),
                   default=0.0)  # fmt: skip
        found[joint] = (lag, rate, limit, "0 0 1" if any(c.symbol == "dr" for c in served) else "0 1 0")
    return found


def _per_unit(aircraft: Aircraft, symbol: str, joint: str) -> float:
    """The joint's angle for each rad of a control."""
    unit = {each: np.array([1.0 if each == symbol else 0.0]) for each in aircraft.control_symbols}
    return float(joint_angles(aircraft, unit)[joint][0])


def add_rotor(root: Element, file: SteadyModel, effects: Effects) -> list[SmallBody]:
    """The rotor's link, joint and motor: thrust in its line, with the moments of an asymmetric one.

    Of ``thrust_yaw`` the part that grows with alpha is that of level flight.
    """
    throttle = file.aircraft.throttle
    if throttle is None or throttle.max_thrust is None:
        return []
    yawing, rolling = thrust_moments(file, effects)
    sin, cos = math.sin(throttle.inclination), math.cos(throttle.inclination)
    # a line through r along (cos, 0, -sin), with a torque of m per newton about it, gives these moments (FRD)
    side, torque = -(rolling * sin + yawing * cos), rolling * cos - yawing * sin
    place = (throttle.arm * sin, -side, -throttle.arm * cos)
    body = SmallBody(inertia=small_inertia(file.aircraft), place=place)
    _small_link(root, "rotor", body, f"{_pose(place)[:-6]} 0 {_text(0.5 * math.pi - throttle.inclination)} 0")
    joint = SubElement(root, "joint", name=plain(throttle.joint), type="revolute")
    SubElement(joint, "parent").text = "base_link"
    SubElement(joint, "child").text = "rotor"
    SubElement(SubElement(joint, "axis"), "xyz").text = "0 0 1"
    lag = effects.get("motor_lag", {}).get("time_constant", 0.0)
    full = throttle.max_thrust * thrust_factor(effects)
    name = "gz::sim::systems::MulticopterMotorModel"
    plugin = SubElement(root, "plugin", filename="gz-sim-multicopter-motor-model-system", name=name)
    words = {"jointName": plain(throttle.joint), "linkName": "rotor", "turningDirection": "ccw" if torque <= 0.0 else
             "cw", "commandSubTopic": "command/motor_speed", "motorType": "velocity", "motorNumber": "0"}  # fmt: skip
    numbers = {"timeConstantUp": lag, "timeConstantDown": lag, "maxRotVelocity": _ROTOR_SPEED,
               "motorConstant": full / _ROTOR_SPEED**2, "momentConstant": abs(torque), "rotorDragCoefficient": 0.0,
               "rollingMomentCoefficient": 0.0, "rotorVelocitySlowdownSim": 1.0}  # fmt: skip
    for tag, text in {**words, **{tag: _text(value) for tag, value in numbers.items()}}.items():
        SubElement(plugin, tag).text = text
    return [body]


def thrust_moments(file: SteadyModel, effects: Effects) -> tuple[float, float]:
    """Yawing and rolling moment for each newton of thrust (m) in level flight."""
    values = effects.get("thrust_yaw", {})
    yawing = values.get("arm", 0.0) + values.get("p_factor", 0.0) * file.level["alpha"]
    return yawing, values.get("torque_arm", 0.0)


def parts_left_out(aircraft: Aircraft, effects: Effects) -> list[str]:
    """What servos and rotor do not hold, a line each."""
    lines = second_order_line(effects)
    lags = first_order_lags(effects)
    for joint in dict.fromkeys(joint for control in aircraft.controls.values() for joint in control.joints):
        served = {c.name: lags.get(c.name, 0.0) for c in aircraft.controls.values() if joint in c.joints}
        if max(served.values()) - min(served.values()) > 1e-9:
            told = ", ".join(f"{name} {lag:g} s" for name, lag in served.items())
            mean = sum(served.values()) / len(served)
            lines.append(f"actuator_lag: joint {plain(joint)} serves {told}; its servo lags by the mean, {mean:g} s")
    limited = {n for n, rate in effects.get("actuator_rate_limit", {}).items() if math.isfinite(rate) and rate}
    if limited & set(lags):
        lines.append("actuator_rate_limit: beside a lag it acts within the servo's loop, not behind it")
    throttle = aircraft.throttle
    if throttle is not None and throttle.max_thrust is None:
        lines.append("thrust: the file states no largest thrust; the model has no motor")
    if effects.get("thrust_yaw", {}).get("p_factor", 0.0):
        lines.append("thrust_yaw: of p_factor only the moment at level flight's alpha")
    if effects.get("motor_lag", {}).get("time_constant", 0.0):
        lines.append("motor_lag: the rotor's speed lags in Gazebo, not its thrust; for small changes it is the same")
    offsets = {c.name: c.offset for c in aircraft.controls.values() if c.offset}
    return lines + [f"offset of {name}'s joint ({value:g} rad): joints count from zero" for name, value in
                    offsets.items()]  # fmt: skip


def _small_link(root: Element, name: str, body: SmallBody, pose: str = "") -> None:
    link = SubElement(root, "link", name=name)
    if pose:
        SubElement(link, "pose").text = pose
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "mass").text = _text(body.mass)
    tensor = SubElement(inertial, "inertia")
    for axis in ("ixx", "iyy", "izz"):
        SubElement(tensor, axis).text = _text(body.inertia)


def _pose(place: tuple[float, float, float]) -> str:
    return " ".join(_text(part) for part in (*place, 0.0, 0.0, 0.0))


def _text(value: float) -> str:
    return f"{finite(value):.12g}"
