"""How fast the joints and the motor of a Gazebo model follow their commands."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element

from sysid_node.aircraft.model import Control
from sysid_node.sim.importing.gazebo.numbers import number_in
from sysid_node.sim.importing.gazebo.sdf import SdfModel

#: A joint controller's largest command where none is stated.
_NO_COMMAND_LIMIT = 1000.0

#: A joint controller's gains where none are stated.
I_GAIN, D_GAIN = 0.1, 0.01

#: What share of a step a joint may take at once that is not worth a word.
_LEAD = 0.05


def servo_effects(model: SdfModel, controls: Mapping[str, Control]) -> dict[str, dict[str, float]]:
    """Lags and rate limits by control: a controller against a joint's damping is a lag of damping over gain."""
    lag, rate = {}, {}
    servos = controllers_of(model.plugins_named("JointPositionController"))
    for name, control in controls.items():
        driven = {joint: servos[joint] for joint in control.joints if joint in servos}
        times = [_servo_lag(model, joint, servo) for joint, servo in driven.items()]
        if times and max(times) > 0.0:
            lag[name] = sum(times) / len(times)
        rates = [abs(control.joints[joint]) * _servo_rate(model, joint, servo) for joint, servo in driven.items()]
        if rates and math.isfinite(sum(rates)):
            rate[name] = sum(rates)
    return {name: values for name, values in (("actuator_lag", lag), ("actuator_rate_limit", rate)) if values}


def controllers_of(plugins: Iterable[Element]) -> dict[str, Element]:
    """The controller of each joint; one controller may move several."""
    return {(e.text or "").strip(): plugin for plugin in plugins for e in plugin.findall("joint_name")}


def leads(model: SdfModel, joints: Iterable[str]) -> dict[str, float]:
    """By joint, what share of a step of its command a derivative gain lets the joint jump at once, where it matters."""
    found = {}
    for joint, controller in controllers_of(model.plugins_named("JointPositionController")).items():
        damping = model.joint_number(joint, "axis/dynamics/damping") or 0.0
        gain = number_in(controller, "d_gain", D_GAIN, model.file)
        if joint in joints and damping > 0.0 and gain > 0.0 and not _follows_at_once(controller):
            found[joint] = gain / (damping + gain)
    return {joint: share for joint, share in found.items() if share > _LEAD}


def motor_effects(constants: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """The motor's lag: the mean of its two time constants."""
    up, down = constants["timeConstantUp"], constants["timeConstantDown"]
    return {"motor_lag": {"time_constant": 0.5 * (up + down)}} if up + down > 0.0 else {}


def _servo_lag(model: SdfModel, joint: str, controller: Element) -> float:
    """Time (s) by which the joint follows a ramp of its command late: its damping over P; inertia is neglected.

    gz-sim's D acts on the rate of the error: with a damping b the joint follows as (D s + P) / ((b + D) s + P), b / P
    late whatever D is.
    """
    gain = number_in(controller, "p_gain", 1.0, model.file)
    if _follows_at_once(controller):
        return 0.0
    damping = model.joint_number(joint, "axis/dynamics/damping") or 0.0
    return damping / gain if gain > 0.0 else 0.0


def _servo_rate(model: SdfModel, joint: str, controller: Element) -> float:
    """The joint's largest rate (rad/s): its largest command, or what this gives against the joint's damping."""
    most = number_in(controller, "cmd_max", _NO_COMMAND_LIMIT, model.file)
    if most >= _NO_COMMAND_LIMIT:
        return math.inf
    damping = model.joint_number(joint, "axis/dynamics/damping") or 0.0
    if _follows_at_once(controller):
        return most
    return most / damping if damping > 0.0 else math.inf


def _follows_at_once(controller: Element) -> bool:
    """Whether the joint moves to its command without a control loop."""
    return (controller.findtext("use_velocity_commands") or "").strip().lower() in ("true", "1")
