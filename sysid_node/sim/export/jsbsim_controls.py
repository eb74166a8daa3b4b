"""The flight control system of an exported JSBSim model: commands, servos and the lever of the thrust."""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement

from sysid_node.aircraft.model import Aircraft, Control
from sysid_node.sim.correcting.jsbsim_servos import PARTS, ServoChange, servo_components
from sysid_node.sim.correcting.jsbsim_stall import stall_channel
from sysid_node.sim.correcting.xml_editing import text_element
from sysid_node.sim.export.cells import finite
from sysid_node.sim.export.folding import Effects, thrust_factor
from sysid_node.sim.importing.jsbsim.actuators import JsbsimServo

_NEWTON = 0.22480894387096  # lbf

#: The throttle that the thrust and tables follow, where it lags or is late; else they follow the command.
_LEVER, _LAGGED = "fcs/throttle-cmd-norm", "fcs/throttle-lagged-norm"


def add_flight_control(root: Element, aircraft: Aircraft, effects: Effects) -> None:
    """Commands, servos and thrust, and the state of the stall where there is one."""
    control = SubElement(root, "flight_control", name="fcs")
    for name in aircraft.controls:
        text_element(control, "property", f"fcs/{name}-cmd-rad", value="0")
    if aircraft.throttle is not None:
        text_element(control, "property", _LEVER, value="0")
    channel = SubElement(control, "channel", name="actuators")
    for name, surface in aircraft.controls.items():
        _add_servo(channel, name, surface, effects)
    _add_thrust(channel, aircraft, effects)
    if effects.get("stall_separation", {}).get("depth", 0.0):
        control.append(stall_channel(effects["stall_separation"]))


def position(control: str) -> str:
    """The property of a control's position, rad."""
    return f"fcs/{control}-position-rad"


def lever(effects: Effects) -> str:
    """The property of the throttle (0..1) as the motor has it."""
    return _LAGGED if any(_lever_times(effects)) else _LEVER


def _add_servo(channel: Element, name: str, surface: Control, effects: Effects) -> None:
    """The control's command in rad and as a share of its limit, and its servo."""
    share = SubElement(channel, "pure_gain", name=f"fcs/{name}-share-rad")
    text_element(share, "input", f"fcs/{name}-cmd-norm")
    text_element(share, "gain", finite(surface.limit or 1.0))
    total = SubElement(channel, "summer", name=f"fcs/{name}-total-rad")
    for source in (f"fcs/{name}-cmd-rad", f"fcs/{name}-share-rad"):
        text_element(total, "input", source)
    if surface.limit is not None:
        clip = SubElement(total, "clipto")
        text_element(clip, "min", finite(-surface.limit))
        text_element(clip, "max", finite(surface.limit))
    servo = servo_of(name, effects)
    wanted = {element: getattr(servo.servo, field) for _, field, element in PARTS}
    for component in servo_components(f"fcs/{name}-total-rad", f"fcs/{name}", 1.0, wanted, servo):
        channel.append(component)
    last = channel[-1]
    if last.tag == "summer" and last.get("name") == f"fcs/{name}-total-rad":  # a servo that does nothing
        last = SubElement(channel, "actuator")
        text_element(last, "input", f"fcs/{name}-total-rad")
    last.set("name", position(name))


def servo_of(control: str, effects: Effects) -> ServoChange:
    """A control's servo by the effects; failures that begin in the course of the flight are not in it."""

    def value(effect: str) -> float:
        size = effects.get(effect, {}).get(control, 0.0)
        return size if math.isfinite(size) else 0.0  # a rate limit that does not act

    servo = JsbsimServo()
    for effect, field, _ in PARTS:
        setattr(servo, field, value(effect))
    damping = effects.get("actuator_lag", {}).get("damping", 0.0) if servo.lag else 0.0
    lost, stuck = (0.0 if _begins(effects, name) else value(name) for name in
                   ("control_effectiveness_loss", "stuck_surface"))  # fmt: skip
    place = effects.get("stuck_surface", {}).get(f"{control}_position", 0.0)
    return ServoChange(servo, damping, lost, (stuck, place))


def _begins(effects: Effects, failure: str) -> bool:
    return effects.get(failure, {}).get("onset", -1.0) > 0.0


def _add_thrust(channel: Element, aircraft: Aircraft, effects: Effects) -> None:
    throttle = aircraft.throttle
    if throttle is None:
        return
    lag, delay = _lever_times(effects)
    if lag or delay:
        motor = SubElement(channel, "actuator", name=_LAGGED)
        text_element(motor, "input", _LEVER)
        if lag:
            text_element(motor, "lag", finite(1.0 / lag))
        if delay:
            text_element(motor, "delay", finite(delay))
    gain = SubElement(channel, "pure_gain", name="fcs/thrust-lbs")
    text_element(gain, "input", lever(effects))
    text_element(gain, "gain", finite((throttle.max_thrust or 1.0) * thrust_factor(effects) * _NEWTON))
    text_element(gain, "output", "external_reactions/thrust/magnitude")


def _lever_times(effects: Effects) -> tuple[float, float]:
    """Lag and delay of the throttle, s."""
    values: Mapping[str, float] = effects.get("command_delay", {})
    return effects.get("motor_lag", {}).get("time_constant", 0.0), values.get("throttle", 0.0)
