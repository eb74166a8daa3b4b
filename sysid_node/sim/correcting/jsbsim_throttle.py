"""A lag and a delay of the thrust in a JSBSim model, between the throttle's lever and the engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Element

from sysid_node.sim.correcting.xml_editing import append_block, text_element
from sysid_node.sim.importing.jsbsim.actuators import inputs_of
from sysid_node.sim.importing.jsbsim.files import outputs_of

Effects = Mapping[str, Mapping[str, float]]


def change_throttle(systems: Sequence[Element], engines: int, old: Effects, new: Effects) -> dict[str, str]:
    """Put the motor's lag and the throttle's delay into the model, in place; what could not be put in, and why."""
    lag = new.get("motor_lag", {}).get("time_constant", 0.0) - old.get("motor_lag", {}).get("time_constant", 0.0)
    delay = (new.get("command_delay", {}).get("throttle", 0.0)) - old.get("command_delay", {}).get("throttle", 0.0)
    if not lag and not delay:
        return {}
    name = "motor_lag" if lag else "command_delay of the throttle"
    if lag < 0.0 or delay < 0.0:
        return {name: "the model itself would have to be quicker"}
    if not engines or not systems:
        return {name: "the model has no engine with a lever"}
    levers = [f"fcs/throttle-{kind}-norm" for kind in ("cmd", "pos")]
    used = {text.split("[")[0] for s in systems for c in s.iter() if isinstance(c.tag, str)
            for text in [*inputs_of(c), *outputs_of(c)]}  # fmt: skip
    if used & set(levers):
        return {name: "the model's own flight control system moves the throttle"}
    channel = Element("channel", name="corrected throttle")
    for i in range(engines):
        actuator = text_element(channel, "actuator", "", name=f"fcs/corrected/throttle-{i}")
        text_element(actuator, "input", f"fcs/throttle-cmd-norm[{i}]")
        if lag:
            text_element(actuator, "lag", 1.0 / lag)
        if delay:
            text_element(actuator, "delay", delay)
        text_element(actuator, "output", f"fcs/throttle-pos-norm[{i}]")
    append_block(systems[0], channel)
    return {}
