"""Writes an ``Aircraft`` as the text of an aircraft file; the inverse of ``load``."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from types import MappingProxyType

import yaml

from sysid_node.aircraft.model import (
    NO_DELAYS,
    Aircraft,
    Control,
    Derivative,
    LookupTable,
    Sensors,
    Throttle,
    UncertainValue,
)
from sysid_node.aircraft.names import CONTROL_SYMBOLS
from sysid_node.aircraft.reading.body import default_noise_bias


def dump_aircraft(aircraft: Aircraft) -> str:
    """YAML text such that ``parse_aircraft(dump_aircraft(a)) == a`` for every aircraft that a file can describe."""
    stated = aircraft.stated_tolerances
    lines = [f"name: {_text(aircraft.name)}", *_source(aircraft.source)]
    lines += ["ideal: true  # a simulator: tolerances that are not stated are zero"] if aircraft.ideal else []
    lines += [f"mass: {_quantity(aircraft.mass, 'mass', stated)}  # kg"]
    lines += _inertia(asdict(aircraft.inertia), stated)
    lines += [f"geometry: {_flow(asdict(aircraft.geometry), 'geometry', stated)}  # m^2, m, m"]
    lines += [f"reference: {_flow(asdict(aircraft.reference), 'reference', stated)}  # m/s, kg/m^3", "controls:"]
    lines += [f"  {_text(name)}: {{{_control(control, stated)}}}" for name, control in aircraft.controls.items()]
    if aircraft.throttle is not None:
        lines += [f"  throttle: {{{_throttle(aircraft.throttle, stated)}}}"]
    lines += [f"outputs: {_text(aircraft.outputs)}"] if aircraft.outputs else []
    lines += [*_sensors(aircraft.sensors, stated), _noise(aircraft), *_delays(aircraft.delays)]
    lines += _effects(aircraft.effects)
    lines += ["tables:", *map(_table, aircraft.tables)] if aircraft.tables else []
    lines += ["derivatives:  # per rad; tolerance 1 sigma"]
    lines += [f"  {name}: {{{_derivative(derivative)}}}" for name, derivative in aircraft.derivatives.items()]
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    return repr(float(value))


def _text(text: str) -> str:
    if text.isascii() and text.isidentifier():
        return text
    return str(yaml.safe_dump(text, default_style='"', width=math.inf)).strip()


def _uncertain(item: UncertainValue) -> str:
    if item.tolerance is None:
        return _number(item.value)
    return f"{{value: {_number(item.value)}, tolerance: {_number(item.tolerance)}}}"


def _quantity(value: float, key: str, stated: Mapping[str, float]) -> str:
    """The number of a dotted key, with the tolerance that the file states for it."""
    return _uncertain(UncertainValue(value, stated.get(key)))


def _flow(values: Mapping[str, float], key: str = "", stated: Mapping[str, float] = MappingProxyType({})) -> str:
    parts = (f"{_text(name)}: {_quantity(value, f'{key}.{name}', stated)}" for name, value in values.items())
    return "{" + ", ".join(parts) + "}"


def _source(text: str) -> list[str]:
    """The source, on several lines where the text can be read back unchanged."""
    if not text:
        return []
    if text != " ".join(text.split()) or not text.isprintable():
        return [f"source: {_text(text)}"]
    wrapped = textwrap.wrap(text, 110, break_long_words=False, break_on_hyphens=False)
    return ["source: >-", *(f"  {line}" for line in wrapped)]


def _inertia(moments: Mapping[str, float], stated: Mapping[str, float]) -> list[str]:
    known = {name: value for name, value in moments.items() if not math.isnan(value)}
    return [f"inertia: {_flow(known, 'inertia', stated)}  # kg m^2"] if known else []


def _control(control: Control, stated: Mapping[str, float]) -> str:
    key = f"controls.{control.name}"
    if len(control.joints) == 1:
        ((joint, scale),) = control.joints.items()
        parts = [f"joint: {_text(joint)}", f"scale: {_quantity(scale, f'{key}.scale', stated)}"]
    else:
        parts = [f"joints: {_flow(control.joints, f'{key}.joints', stated)}"]
    parts.append(f"offset: {_quantity(control.offset, f'{key}.offset', stated)}")
    if control.limit is not None:
        parts.append(f"limit: {_quantity(control.limit, f'{key}.limit', stated)}")
    if control.full_deflection is not None:
        parts.append(f"full_deflection: {_number(control.full_deflection)}")
    if control.name not in CONTROL_SYMBOLS:
        parts.append(f"symbol: {control.symbol}")
    return ", ".join(parts)


def _throttle(throttle: Throttle, stated: Mapping[str, float]) -> str:
    def number(name: str, value: float) -> str:
        return f"{name}: {_quantity(value, f'throttle.{name}', stated)}"

    thrust = "unit: newton" if throttle.max_thrust is None else number("max_thrust", throttle.max_thrust)
    parts = [f"joint: {_text(throttle.joint)}", thrust]
    return ", ".join([*parts, number("inclination", throttle.inclination), number("arm", throttle.arm)])


def _sensors(sensors: Sensors, stated: Mapping[str, float]) -> list[str]:
    if sensors == Sensors() and not any(key.startswith("sensors.") for key in stated):
        return []
    places = []
    for name, place in asdict(sensors).items():
        axes = (_quantity(x, f"sensors.{name}.{axis}", stated) for axis, x in zip("xyz", place, strict=True))
        places.append(f"{name}: [{', '.join(axes)}]")
    return [f"sensors: {{{', '.join(places)}}}  # m from the CG, forward-right-down"]


def _noise(aircraft: Aircraft) -> str:
    noise = _flow(aircraft.noise)
    if dict(aircraft.noise_bias) != default_noise_bias(ideal=aircraft.ideal):
        noise = f"{noise[:-1]}, bias: {_flow(aircraft.noise_bias)}}}"
    return f"noise: {noise}  # 1 sigma, SI"


def _delays(delays: Mapping[str, UncertainValue]) -> list[str]:
    stated = [f"{topic}: {_uncertain(delay)}" for topic, delay in delays.items() if delay != NO_DELAYS[topic]]
    return [f"delays: {{{', '.join(stated)}}}  # s, stamp minus time of the event"] if stated else []


def _effects(effects: Mapping[str, Mapping[str, UncertainValue]]) -> list[str]:
    rows = []
    for name, values in effects.items():
        parameters = ", ".join(f"{_text(key)}: {_uncertain(item)}" for key, item in values.items())
        rows.append(f"  {name}: {{{parameters}}}")
    return ["effects:  # what the simulator models beyond the derivatives", *rows] if rows else []


def _table(table: LookupTable) -> str:
    points = [f"{name}: {_list(x)}" for name, x in zip(table.over, table.points, strict=True)]
    over = ", ".join(table.over)
    parts = [f"coefficient: {table.coefficient}", f"over: [{over}]", *points, f"values: {_list(table.values)}"]
    return f"  - {{{', '.join(parts)}}}"


def _list(values: Sequence[float] | Sequence[Sequence[float]]) -> str:
    items = (_list(value) if isinstance(value, Sequence) else _number(value) for value in values)
    return f"[{', '.join(items)}]"


def _derivative(derivative: Derivative) -> str:
    value = f"value: {_number(derivative.value)}"
    return value if derivative.tolerance is None else f"{value}, tolerance: {_number(derivative.tolerance)}"
