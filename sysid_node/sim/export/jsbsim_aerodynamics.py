"""The aerodynamics of an exported JSBSim model: coefficients as functions of JSBSim's properties, and the axes.

Forces are summed along body axes, and therefore do not depend on a convention of wind axes. Effects are the terms that
``sim.correcting`` writes into models as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element, SubElement

from sysid_node.aircraft.model import Aircraft, LookupTable, UncertainValue
from sysid_node.aircraft.names import COEFFICIENTS, split_derivative
from sysid_node.errors import InputError
from sysid_node.sim.correcting.effect_increments import IN_SLIPSTREAM, ModelProperties, increments_between
from sysid_node.sim.correcting.jsbsim_loads import REGRESSORS, Increments, add_increments, add_terms
from sysid_node.sim.correcting.jsbsim_stall import add_stall, lift_factor
from sysid_node.sim.correcting.xml_editing import product_of, text_element
from sysid_node.sim.export.cells import finite
from sysid_node.sim.export.folding import Effects
from sysid_node.sim.export.jsbsim_controls import lever, position

#: The thrust, lbf.
_THRUST = "external_reactions/thrust/magnitude"

#: Effects that are terms of coefficients or moments of the thrust.
_TERMS = ("nonlinear_pitching_moment", "unsteady_aerodynamics", "lateral_alpha_coupling", "lateral_asymmetry",
          "drag_rise", "thrust_yaw")  # fmt: skip

#: What a table may be over: JSBSim's property, and its units in one of ours.
_VARIABLES = {
    "alpha": ("aero/alpha-rad", 1.0),
    "beta": ("aero/beta-rad", 1.0),
    "V": ("velocities/vt-fps", 1.0 / 0.3048),
    "Mach": ("velocities/mach", 1.0),
    **{rate: (f"aero/reduced/{rate}", 1.0) for rate in "pqr"},
}


@dataclass(frozen=True)
class _Names:
    """The properties of deflections (rad, as the derivatives take them) by symbol, and of the throttle."""

    deflections: Mapping[str, str]
    throttle: str


def add_aerodynamics(root: Element, aircraft: Aircraft, effects: Effects) -> None:
    """The functions, the axes, and the moments of the thrust. Raises InputError where a number is not finite."""
    aerodynamics = SubElement(root, "aerodynamics")
    for rate in "pqr":
        if any(rate in table.over for table in aircraft.tables):
            product_of(_function(aerodynamics, f"aero/reduced/{rate}"), REGRESSORS[rate])
    names = _Names(_deflections(aerodynamics, aircraft, effects), lever(effects))
    increments = _increments(aircraft, effects)
    stalls = bool(effects.get("stall_separation", {}).get("depth", 0.0))
    for coefficient in COEFFICIENTS:
        attached = "-attached" if coefficient == "CL" and stalls else ""
        total = _sum_of(aerodynamics, f"aero/coefficient/{coefficient}{attached}")
        _add_coefficient(total, aircraft, coefficient, names)
        add_terms(total, increments.coefficients.get(coefficient, []))
        if attached:
            product = product_of(_function(aerodynamics, "aero/coefficient/CL"), ["aero/coefficient/CL-attached"])
            lift_factor(product, effects["stall_separation"])
    _add_axes(aerodynamics)
    add_increments(root, aerodynamics, replace(increments, coefficients={}), (0.0, 0.0, 0.0))


def _increments(aircraft: Aircraft, effects: Effects) -> Increments:
    """The terms of effects; those of lift take the model's own."""
    stated = {name: {key: UncertainValue(finite(value)) for key, value in effects[name].items()}
              for name in _TERMS if name in effects}  # fmt: skip
    thrust = _THRUST if aircraft.throttle is not None else None
    properties = ModelProperties(
        {name: (position(name), 1.0) for name in aircraft.controls}, thrust, ("aero/coefficient/CL",)
    )
    found = increments_between(aircraft, replace(aircraft, effects=stated), properties)
    if effects.get("stall_separation", {}).get("depth", 0.0):
        add_stall(found, effects["stall_separation"], lift=None)
    return found


def _deflections(aerodynamics: Element, aircraft: Aircraft, effects: Effects) -> dict[str, str]:
    """The property of each control's deflection: its position, or a function of it."""
    names = {}
    for name, control in aircraft.controls.items():
        cubic = effects.get("control_nonlinearity", {}).get(name, 0.0)
        washed = effects.get("propwash", {}).get("gain", 0.0) if name in IN_SLIPSTREAM and aircraft.throttle else 0.0
        names[control.symbol] = position(name)
        if not cubic and not washed:
            continue
        names[control.symbol] = f"aero/effective/{name}-rad"
        product = product_of(_function(aerodynamics, names[control.symbol]), [position(name)])
        if cubic:
            less = text_element(product, "difference", "")
            text_element(less, "value", 1.0)
            product_of(less, [position(name)] * 2, finite(cubic))
        if washed:
            more = text_element(product, "sum", "")
            text_element(more, "value", 1.0)
            share = text_element(more, "quotient", "")
            product_of(share, [_THRUST], finite(washed))
            product_of(share, ("aero/qbar-psf", "metrics/Sw-sqft"))
    return names


def _add_coefficient(total: Element, aircraft: Aircraft, coefficient: str, names: _Names) -> None:
    """One coefficient as a sum of derivatives times regressors, and tables."""
    for name, derivative in aircraft.derivatives.items():
        belongs, regressor = split_derivative(name)
        if belongs != coefficient:
            continue
        value = finite(derivative.value)
        if regressor == "0":
            text_element(total, "value", value)
        elif regressor == "V":
            product_of(total, ["velocities/vt-fps"], value * 0.3048 / aircraft.reference.airspeed)
        elif regressor == "k":
            product_of(total, ["aero/coefficient/CL"] * 2, value)
        elif regressor in names.deflections:
            product_of(total, [names.deflections[regressor]], value)
        else:
            product_of(total, REGRESSORS[regressor], value)
    for table in aircraft.tables:
        if table.coefficient == coefficient:
            _add_table(total, table, names)


def _add_table(parent: Element, table: LookupTable, names: _Names) -> None:
    """A lookup table."""
    variables = {**_VARIABLES, **{symbol: (place, 1.0) for symbol, place in names.deflections.items()}}
    variables["throttle"] = (names.throttle, 1.0)
    element = SubElement(parent, "table")
    scales = []
    for over, lookup in zip(table.over, ("row", "column"), strict=False):
        if over not in variables:
            raise InputError(f"table over {over!r}: the aircraft has no such variable")
        place, scale = variables[over]
        scales.append(scale)
        text_element(element, "independentVar", place, lookup=lookup)
    rows = [[x * scales[0]] for x in table.points[0]]
    for row, values in zip(rows, table.values, strict=True):
        row.extend(values if isinstance(values, tuple) else (values,))
    lines = [" ".join(repr(finite(x)) for x in row) for row in rows]
    if len(table.over) == 2:
        lines.insert(0, " ".join(repr(finite(x * scales[1])) for x in table.points[1]))
    SubElement(element, "tableData").text = "\n" + "\n".join(lines) + "\n"  # a row a line


def _add_axes(aerodynamics: Element) -> None:
    stability = {"X": (("CL", "sin", 1.0), ("CD", "cos", -1.0)), "Z": (("CL", "cos", -1.0), ("CD", "sin", -1.0))}
    for axis in ("X", "Y", "Z"):
        total = _function(SubElement(aerodynamics, "axis", name=axis), f"aero/force/{axis}")
        product = product_of(total, ("aero/qbar-psf", "metrics/Sw-sqft"))
        if axis == "Y":
            text_element(product, "property", "aero/coefficient/CY")
            continue
        parts = SubElement(product, "sum")
        for name, turn, sign in stability[axis]:
            part = product_of(parts, [f"aero/coefficient/{name}"])
            text_element(SubElement(part, turn), "property", "aero/alpha-rad")
            text_element(part, "value", sign)
    for axis, name, length in (("ROLL", "Cl", "bw-ft"), ("PITCH", "Cm", "cbarw-ft"), ("YAW", "Cn", "bw-ft")):
        total = _function(SubElement(aerodynamics, "axis", name=axis), f"aero/moment/{axis}")
        product_of(total, ("aero/qbar-psf", "metrics/Sw-sqft", f"metrics/{length}", f"aero/coefficient/{name}"))


def _function(parent: Element, name: str) -> Element:
    return SubElement(parent, "function", name=name)


def _sum_of(parent: Element, name: str) -> Element:
    total = SubElement(_function(parent, name), "sum")
    text_element(total, "value", 0.0)
    return total
