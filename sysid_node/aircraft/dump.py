"""Writes an ``Aircraft`` as the text of an aircraft file; the inverse of ``load``."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from dataclasses import asdict

import yaml

from sysid_node.aircraft.model import Aircraft, Control, Derivative, Sensors, Throttle
from sysid_node.aircraft.names import CONTROL_SYMBOLS


def dump_aircraft(aircraft: Aircraft) -> str:
    """YAML text such that ``parse_aircraft(dump_aircraft(a)) == a`` for every aircraft that a file can describe."""
    lines = [f"name: {_text(aircraft.name)}", *_source(aircraft.source)]
    lines += [f"mass: {_number(aircraft.mass)}  # kg", *_inertia(asdict(aircraft.inertia))]
    lines += [f"geometry: {_flow(asdict(aircraft.geometry))}  # m^2, m, m"]
    lines += [f"reference: {_flow(asdict(aircraft.reference))}  # m/s, kg/m^3", "controls:"]
    lines += [f"  {_text(name)}: {{{_control(control)}}}" for name, control in aircraft.controls.items()]
    if aircraft.throttle is not None:
        lines += [f"  throttle: {{{_throttle(aircraft.throttle)}}}"]
    lines += _sensors(aircraft.sensors)
    lines += [f"noise: {_flow(aircraft.noise)}  # 1 sigma, SI", "derivatives:  # per rad; tolerance 1 sigma"]
    lines += [f"  {name}: {{{_derivative(derivative)}}}" for name, derivative in aircraft.derivatives.items()]
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    return repr(float(value))


def _text(text: str) -> str:
    if text.isascii() and text.isidentifier():
        return text
    return str(yaml.safe_dump(text, default_style='"', width=math.inf)).strip()


def _flow(values: Mapping[str, float]) -> str:
    return "{" + ", ".join(f"{_text(key)}: {_number(value)}" for key, value in values.items()) + "}"


def _source(text: str) -> list[str]:
    """The source, on several lines where the text can be read back unchanged."""
    if not text:
        return []
    if text != " ".join(text.split()) or not text.isprintable():
        return [f"source: {_text(text)}"]
    wrapped = textwrap.wrap(text, 110, break_long_words=False, break_on_hyphens=False)
    return ["source: >-", *(f"  {line}" for line in wrapped)]


def _inertia(moments: Mapping[str, float]) -> list[str]:
    known = {name: value for name, value in moments.items() if not math.isnan(value)}
    return [f"inertia: {_flow(known)}  # kg m^2"] if known else []


def _control(control: Control) -> str:
    if len(control.joints) == 1:
        ((joint, scale),) = control.joints.items()
        parts = [f"joint: {_text(joint)}", f"scale: {_number(scale)}"]
    else:
        parts = [f"joints: {_flow(control.joints)}"]
    parts.append(f"offset: {_number(control.offset)}")
    if control.limit is not None:
        parts.append(f"limit: {_number(control.limit)}")
    if control.name not in CONTROL_SYMBOLS:
        parts.append(f"symbol: {control.symbol}")
    return ", ".join(parts)


def _throttle(throttle: Throttle) -> str:
    thrust = "unit: newton" if throttle.max_thrust is None else f"max_thrust: {_number(throttle.max_thrust)}"
    parts = [f"joint: {_text(throttle.joint)}", thrust]
    parts += [f"inclination: {_number(throttle.inclination)}", f"arm: {_number(throttle.arm)}"]
    return ", ".join(parts)


def _sensors(sensors: Sensors) -> list[str]:
    if sensors == Sensors():
        return []
    places = [f"{name}: [{', '.join(map(_number, place))}]" for name, place in asdict(sensors).items()]
    return [f"sensors: {{{', '.join(places)}}}  # m from the CG, forward-right-down"]


def _derivative(derivative: Derivative) -> str:
    value = f"value: {_number(derivative.value)}"
    return value if derivative.tolerance is None else f"{value}, tolerance: {_number(derivative.tolerance)}"
