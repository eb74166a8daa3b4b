"""Servos of a JSBSim model changed in its flight control system.

Where the model has an actuator between a control's command and its position, that actuator is changed. Where it has
none, one is put behind each component that writes a position of the control (left and right aileron, for example): the
component then writes another property, which the actuator reads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from sysid_node.sim.correcting.xml_editing import insert_block, text_element
from sysid_node.sim.importing.jsbsim.actuators import JsbsimServo, inputs_of
from sysid_node.sim.importing.jsbsim.files import outputs_of
from sysid_node.sim.importing.jsbsim.surfaces import JsbsimSurface
from sysid_node.sim.importing.jsbsim.survey import ServoChain

#: The parts of a servo: effect, field of ``Servo``, and JSBSim's element, in the order in which an actuator has them.
PARTS = (
    ("actuator_lag", "lag", "lag"),
    ("actuator_rate_limit", "rate", "rate_limit"),
    ("actuator_bias", "offset", "bias"),
    ("actuator_backlash", "free_play", "hysteresis_width"),
    ("command_delay", "delay", "delay"),
)


@dataclass(frozen=True)
class ServoChange:
    """One control's servo as it is to be, in s, rad and rad/s; ``damping`` of a lag of second order, 0 of first."""

    servo: JsbsimServo
    damping: float = 0.0
    lost: float = 0.0  # share of the control's effect
    stuck: tuple[float, float] = (0.0, 0.0)  # how much of the surface is jammed, and where (rad)


def change_servo(
    sections: Sequence[Element], surface: JsbsimSurface, chain: ServoChain, before: JsbsimServo, change: ServoChange
) -> bool:
    """Change a control's servo in the sections of a flight control system, in place.

    Returns whether it could be changed: False where no component writes the control's position.
    """
    wanted = change.servo
    changed = {element: getattr(wanted, field) for _, field, element in PARTS
               if abs(getattr(wanted, field) - getattr(before, field)) > 1e-12}  # fmt: skip
    actuator = _actuator_of(sections, chain)
    if actuator is not None and not change.damping:
        gain = next((chain.gains[n] for n in outputs_of(actuator) if n in chain.gains), 1.0)
        previous = {element: getattr(before, field) for _, field, element in PARTS}
        for element, value in changed.items():
            _set(actuator, element, value, previous[element], gain)
        changed = {}
    if not (changed or change.lost):
        return True
    writers = _writers(sections, surface)
    for holder, writer, name in writers:
        slope = _slope(surface, name)
        first, prefix = _new_name(name, "commanded"), _new_name(name, "")[:-1]
        _put_behind(holder, writer, name, servo_components(first, prefix, slope, changed, change))
    return bool(writers)


def _writers(sections: Sequence[Element], surface: JsbsimSurface) -> list[tuple[Element, Element, str]]:
    """The components that write a position of the control, each with its channel and the property.

    Those that only convert one position into another are left out.
    """
    written = []
    for section in sections:
        for holder in [section, *section.findall("channel")]:
            for component in holder:
                names = [name for name in outputs_of(component) if name in surface.properties]
                if names and component.tag not in ("channel", "property"):
                    written.append((holder, component, names[0]))
    places = {_place(name) for _, _, name in written}
    return [each for each in written if not {_place(name) for name in inputs_of(each[1])} & places]


def _place(name: str) -> str:
    """A position's name without its unit: JSBSim keeps a surface's rad, deg and share of travel together."""
    return name.removesuffix("-rad").removesuffix("-deg").removesuffix("-norm").replace("fcs/mag-", "fcs/")


def _put_behind(holder: Element, writer: Element, name: str, components: Sequence[Element]) -> None:
    """Let a component write another property, from which new components make the one that it wrote."""
    raw = _new_name(name, "commanded")
    outputs = [o for o in writer.findall("output") if (o.text or "").strip() == name]
    for output in outputs:
        output.text = raw
    if not outputs:
        text_element(writer, "output", raw)
        writer.set("name", _new_name(name, "own"))
    text_element(components[-1], "output", name)
    place = list(holder).index(writer) + 1
    for component in reversed(components):
        insert_block(holder, place, component)


def _new_name(name: str, what: str) -> str:
    """A property that this program puts into a model."""
    return f"fcs/corrected/{name.removeprefix('fcs/').replace('/', '-')}-{what}"


def _slope(surface: JsbsimSurface, name: str) -> float:
    """Units of a property per rad of the control, about the middle of its travel."""
    values, deflection = surface.properties[name], surface.deflection
    near = np.argsort(np.abs(deflection - 0.5 * (deflection[0] + deflection[-1])))[:3]
    return float(np.polyfit(deflection[near], values[near], 1)[0])


def _actuator_of(sections: Sequence[Element], chain: ServoChain) -> Element | None:
    """The model's own actuator between command and position, if there is one."""
    for section in sections:
        for actuator in section.iter("actuator"):
            if set(outputs_of(actuator)) & set(chain.outputs):
                return actuator
    return None


def _set(actuator: Element, tag: str, total: float, before: float, gain: float) -> None:
    """Change one number of an actuator, so that the control's ``total`` becomes what is wanted.

    The time constants and delays of several components add up: the actuator takes the difference. ``gain`` is the
    control's rad per unit of the actuator.
    """
    element = actuator.find(tag)
    here = float((element.text or "0").strip()) if element is not None else 0.0
    if tag == "lag":
        constant = (1.0 / here if here else 0.0) + total - before
        value = 1.0 / constant if constant > 1e-6 else 0.0
    elif tag == "delay":
        if element is not None and element.attrib.pop("type", "time") == "frames":
            here = before
        value = max(here + total - before, 0.0)
    else:
        value = total / gain
    if element is not None and not value:
        actuator.remove(element)
    elif element is not None:
        element.text = repr(value)
    elif value:
        text_element(actuator, tag, value)
        actuator[-1].tail = "\n      "


def servo_components(
    first: str, prefix: str, slope: float, parts: Mapping[str, float], change: ServoChange
) -> list[Element]:
    """The components of a servo: a filter where the lag is of second order, an actuator, and a gain where effect is
    lost; some of them or none.

    ``first`` is the property that the first reads. Their names begin with ``prefix``; ``slope`` is in units of the
    property for each rad of the control. ``parts`` are the numbers by the actuator's elements, s, rad and rad/s.
    """
    components: list[Element] = []
    values = {element: value for element, value in parts.items() if value}

    def source() -> str:
        return str(components[-1].get("name")) if components else first

    if change.damping and "lag" in values:
        components.append(_second_order(f"{prefix}-lag", source(), values.pop("lag"), change.damping))
    if values:
        actuator = Element("actuator", name=f"{prefix}-servo")
        text_element(actuator, "input", source())
        for _, _, element in PARTS:
            if element in values:
                text_element(actuator, element, _in_units(element, values[element], slope))
        components.append(actuator)
    amount, place = change.stuck
    if amount:
        components.append(_gain(f"{prefix}-moved", source(), 1.0 - amount))
        jammed = Element("summer", name=f"{prefix}-jammed")
        text_element(jammed, "input", source())
        text_element(jammed, "bias", amount * place * slope)
        components.append(jammed)
    if change.lost:
        components.append(_gain(f"{prefix}-effect", source(), 1.0 - change.lost))
    return components


def _gain(name: str, source: str, value: float) -> Element:
    gain = Element("pure_gain", name=name)
    text_element(gain, "input", source)
    text_element(gain, "gain", value)
    return gain


def _in_units(element: str, value: float, slope: float) -> float:
    """A number of an actuator in the units of its property, ``slope`` of which are a rad of the control."""
    if element == "lag":
        return 1.0 / value
    if element == "delay":
        return value
    return value * (slope if element == "bias" else abs(slope))


def _second_order(name: str, source: str, tau: float, damping: float) -> Element:
    element = Element("second_order_filter", name=name)
    text_element(element, "input", source)
    for tag, value in (("c1", 0.0), ("c2", 0.0), ("c3", 1.0), ("c4", tau * tau), ("c5", 2.0 * damping * tau),
                       ("c6", 1.0)):  # fmt: skip
        text_element(element, tag, value)
    return element
