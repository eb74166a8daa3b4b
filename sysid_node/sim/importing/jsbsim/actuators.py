"""The servos of a JSBSim model: lag, rate limit, delay, free play and offset of the components that drive a surface."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from xml.etree.ElementTree import Element

from sysid_node.sim.importing.jsbsim.files import outputs_of

#: Properties that no pilot gives: what reads them is a control law, and no servo.
_MOTION = ("velocities/", "attitude/", "aero/", "accelerations/", "position/", "sensor/")


@dataclass
class JsbsimServo:
    """One control's servo, in the surface's units (s, rad, rad/s), and what of it was not understood."""

    lag: float = 0.0
    damping: float = 0.0  # of a lag of second order; 0: of first order
    rate: float = 0.0  # 0 = without limit
    delay: float = 0.0
    free_play: float = 0.0
    offset: float = 0.0
    laws: list[str] = field(default_factory=list)  # motion that is fed back

    def effects(self) -> dict[str, float]:
        """Effect -> size, of those that the servo has."""
        sizes = {
            "actuator_lag": self.lag,
            "actuator_rate_limit": self.rate,
            "command_delay": self.delay,
            "actuator_backlash": self.free_play,
            "actuator_bias": self.offset,
        }
        return {name: size for name, size in sizes.items() if size}


def chain_to(position: str, sections: Sequence[Element], command: str, others: Collection[str] = ()) -> list[Element]:
    """The components between a command and a position, the last first; other inputs are followed as well.

    ``others`` are commands that move the position, too: what follows one of them and not ``command`` is left out.
    """
    found = _followed(position, sections, command)
    if not others:
        return found
    return [component for component in found if not _of_others(component, sections, command, others)]


def _of_others(component: Element, sections: Sequence[Element], command: str, others: Collection[str]) -> bool:
    """Whether a component follows another command, and not this one."""
    before = [component, *(c for name in inputs_of(component) for c in _followed(name, sections, command))]
    read = {name for c in before for name in inputs_of(c)}
    return command not in read and bool(read & set(others))


def _followed(position: str, sections: Sequence[Element], command: str) -> list[Element]:
    """The components that a position follows from, the last first."""
    writers: dict[str, Element] = {}
    for section in sections:
        for holder in [section, *section.findall("channel")]:
            for component in holder:
                for name in outputs_of(component):
                    writers.setdefault(name, component)
    found: list[Element] = []
    waiting, seen = [position], {position, command}
    while waiting:
        writer = writers.get(waiting.pop(0))
        if writer is None or any(writer is other for other in found):
            continue
        found.append(writer)
        new = [name for name in inputs_of(writer) if name not in seen]
        seen |= set(new)
        waiting += new
    return found


def inputs_of(component: Element) -> list[str]:
    """The properties that a component reads."""
    tags = ("input", "property", "p", "independentVar")
    texts = ((e.text or "").strip().lstrip("-") for e in component.iter() if e.tag in tags)
    return [text for text in texts if "/" in text]


def read_servo(chain: Sequence[Element], gains: Mapping[str, float], rate: float) -> JsbsimServo:
    """The servo of a chain of components.

    ``gains`` are the surface's rad per unit of a component's output, by property; ``rate`` is the simulator's, Hz, for
    delays that are given in frames.
    """
    servo = JsbsimServo()
    for component in chain:
        gain = next((abs(gains[name]) for name in outputs_of(component) if name in gains), 1.0)
        servo.laws += [name for name in inputs_of(component) if name.startswith(_MOTION)]
        if component.tag == "actuator":
            _add_actuator(servo, component, gain, rate)
        elif component.tag == "lag_filter":
            corner = _number(component, "c1")
            servo.lag += 1.0 / corner if corner > 0.0 else 0.0
        elif component.tag == "second_order_filter":
            _add_second_order(servo, component)
        elif component.tag == "kinematic":
            slowest = _kinematic_rate(component)
            if slowest > 0.0:
                servo.rate = min(servo.rate or slowest * gain, slowest * gain)
    return servo


def _add_actuator(servo: JsbsimServo, component: Element, gain: float, rate: float) -> None:
    corner, limit = _number(component, "lag"), _number(component, "rate_limit")
    if corner > 0.0:
        servo.lag += 1.0 / corner
    if limit > 0.0:
        servo.rate = min(servo.rate or limit * gain, limit * gain)
    delay = component.find("delay")
    if delay is not None:
        frames = delay.get("type", "time") == "frames"
        servo.delay += _number(component, "delay") / (rate if frames else 1.0)
    servo.free_play += _number(component, "hysteresis_width") * gain
    servo.offset += _number(component, "bias") * gain


def _add_second_order(servo: JsbsimServo, component: Element) -> None:
    """A filter 1 / (T^2 s^2 + 2 damping T s + 1): alone a servo of second order, beside other lags a lag as late."""
    c1, c2, c3, c4, c5, c6 = (_number(component, f"c{k}") for k in range(1, 7))
    if c1 or c2 or c3 != c6 or c3 <= 0.0 or c4 <= 0.0 or c5 < 0.0:
        return
    time = math.sqrt(c4 / c6)
    if servo.lag:
        servo.lag += c5 / c6
    else:
        servo.lag, servo.damping = time, 0.5 * c5 / (c6 * time)


def throttle_times(sections: Sequence[Element], lever: str) -> tuple[float, float]:
    """Lag and delay (s) of the actuators that read the throttle's lever."""
    servo = JsbsimServo()
    actuators = [a for section in sections for a in section.iter("actuator")]
    reading = [a for a in actuators if lever in {name.partition("[")[0] for name in inputs_of(a)}]
    for actuator in reading[:1]:  # those of several engines are alike
        _add_actuator(servo, actuator, 1.0, 1.0)
    return servo.lag, servo.delay


def _number(component: Element, tag: str) -> float:
    """A number; 0 where it is absent or a property, which may change in flight."""
    element = component.find(tag)
    try:
        return float((element.text or "").strip()) if element is not None else 0.0
    except ValueError:
        return 0.0


def _kinematic_rate(component: Element) -> float:
    """The slowest rate between two detents, units of the output per s."""
    settings = component.findall("traverse/setting")
    rates = []
    for before, after in pairwise(settings):
        time = _number(after, "time")
        if time > 0.0:
            rates.append(abs(_number(after, "position") - _number(before, "position")) / time)
    return min(rates, default=0.0)
