"""The aircraft as a JSBSim model (JSBSim-ML 2.0).

Coefficients are functions of JSBSim's own properties; forces are summed along body axes, and therefore do not depend on
a convention of wind axes. Commands are ``fcs/<control>-cmd-rad`` (rad), to which JSBSim's usual
``fcs/<control>-cmd-norm`` is added as a share of the control's limit, and ``fcs/throttle-cmd-norm``. JSBSim's
structural axes run aft, right, up, and its product of inertia is minus the usual Ixz.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from sysid_node.aircraft.model import Aircraft, LookupTable
from sysid_node.aircraft.names import COEFFICIENTS, split_derivative
from sysid_node.errors import InputError
from sysid_node.sim.export.cells import finite, plain
from sysid_node.sim.export.exported import Exported
from sysid_node.sim.export.losses import not_held

#: Effects that JSBSim's own blocks can express.
EFFECTS = (
    "actuator_lag",
    "actuator_rate_limit",
    "command_delay",
    "cg_shift",
    "thrust_line_offset",
    "derivative_error",
)

_NEWTON = 0.22480894387096  # lbf

Effects = Mapping[str, Mapping[str, float]]

_REGRESSORS = {
    "alpha": ("aero/alpha-rad",),
    "beta": ("aero/beta-rad",),
    "p": ("velocities/p-aero-rad_sec", "aero/bi2vel"),
    "q": ("velocities/q-aero-rad_sec", "aero/ci2vel"),
    "r": ("velocities/r-aero-rad_sec", "aero/bi2vel"),
    "k": ("aero/coefficient/CL", "aero/coefficient/CL"),
}


def jsbsim_model(aircraft: Aircraft, effects: Effects | None = None) -> str:
    """The model's XML. Raises InputError for an effect that is not in ``EFFECTS``, or an unknown moment of inertia."""
    effects = effects or {}
    unsupported = [name for name in effects if name not in EFFECTS]
    if unsupported:
        raise InputError(
            f"effect {unsupported[0]!r} cannot be exported to jsbsim; those that can: {', '.join(EFFECTS)}"
        )
    root = Element("fdm_config", name=plain(aircraft.name), version="2.0", release="BETA")
    header = SubElement(root, "fileheader")
    _text(header, "author", "sysid export")
    _text(header, "description", aircraft.source or aircraft.name)
    _metrics(root, aircraft)
    _mass_balance(root, aircraft, effects.get("cg_shift", {}))
    SubElement(root, "ground_reactions")
    _thrust_force(root, aircraft, effects.get("thrust_line_offset", {}).get("arm", 0.0))
    SubElement(root, "propulsion")
    _flight_control(root, aircraft, effects)
    _aerodynamics(root, aircraft, effects.get("derivative_error", {}))
    indent(root, "  ")
    return '<?xml version="1.0"?>\n' + tostring(root, encoding="unicode") + "\n"


_WHY = {
    "ground_effect": "the aerodynamics of the model hold none",
    "structural_mode": "the model is rigid",
}


def export_jsbsim(aircraft: Aircraft, effects: Effects | None = None) -> Exported:
    """The model, and what it does not hold. Raises InputError for an unknown moment of inertia."""
    held = {name: values for name, values in (effects or {}).items() if name in EFFECTS}
    lines = not_held(effects or {}, EFFECTS, _WHY)
    if held.get("actuator_lag", {}).get("damping"):
        lines.append("actuator_lag: its damping (actuators are of first order)")
    return Exported(jsbsim_model(aircraft, held), tuple(lines), frozenset(EFFECTS))


def _text(parent: Element, tag: str, text: str | float, **attributes: str) -> Element:
    element = SubElement(parent, tag, attributes)
    element.text = plain(text) if isinstance(text, str) else repr(finite(text))
    return element


def _location(parent: Element, x: float, y: float, z: float, **attributes: str) -> None:
    """A point given in body axes (m, forward-right-down) from the aircraft file's CG."""
    place = SubElement(parent, "location", {**attributes, "unit": "M"})
    for axis, value in (("x", -x), ("y", y), ("z", -z)):
        _text(place, axis, value)


def _metrics(root: Element, aircraft: Aircraft) -> None:
    metrics, geometry = SubElement(root, "metrics"), aircraft.geometry
    _text(metrics, "wingarea", geometry.S, unit="M2")
    _text(metrics, "wingspan", geometry.b, unit="M")
    _text(metrics, "chord", geometry.cbar, unit="M")
    for name in ("AERORP", "EYEPOINT", "VRP"):
        _location(metrics, 0.0, 0.0, 0.0, name=name)


def _mass_balance(root: Element, aircraft: Aircraft, shift: Mapping[str, float]) -> None:
    balance, inertia = SubElement(root, "mass_balance"), aircraft.inertia
    for tag, value in (("ixx", inertia.Ixx), ("iyy", inertia.Iyy), ("izz", inertia.Izz), ("ixz", -inertia.Ixz)):
        if not math.isfinite(value):
            raise InputError(f"aircraft {aircraft.name!r}: {tag} is not known; JSBSim needs it: complete the file")
        _text(balance, tag, value, unit="KG*M2")
    _text(balance, "emptywt", aircraft.mass, unit="KG")
    _location(balance, shift.get("x", 0.0), shift.get("y", 0.0), shift.get("z", 0.0), name="CG")


def _thrust_force(root: Element, aircraft: Aircraft, arm: float) -> None:
    """Thrust as a force on the body, its line below the CG by the file's arm and the effect's."""
    throttle = aircraft.throttle
    if throttle is None:
        return
    along, up = math.cos(throttle.inclination), math.sin(throttle.inclination)
    force = SubElement(SubElement(root, "external_reactions"), "force", name="thrust", frame="BODY")
    # the arm is nose-up moment per newton: a line that far below the CG, measured across the thrust
    _location(force, (throttle.arm + arm) * up, 0.0, (throttle.arm + arm) * along)
    direction = SubElement(force, "direction")
    for axis, value in (("x", along), ("y", 0.0), ("z", -up)):
        _text(direction, axis, value)


def _flight_control(root: Element, aircraft: Aircraft, effects: Effects) -> None:
    control = SubElement(root, "flight_control", name="fcs")
    for name in aircraft.controls:
        _text(control, "property", f"fcs/{name}-cmd-rad", value="0")
    if aircraft.throttle is not None:
        _text(control, "property", "fcs/throttle-cmd-norm", value="0")
    channel = SubElement(control, "channel", name="actuators")
    for name, surface in aircraft.controls.items():
        share = SubElement(channel, "pure_gain", name=f"fcs/{name}-share-rad")
        _text(share, "input", f"fcs/{name}-cmd-norm")
        _text(share, "gain", surface.limit or 1.0)
        total = SubElement(channel, "summer", name=f"fcs/{name}-total-rad")
        for source in (f"fcs/{name}-cmd-rad", f"fcs/{name}-share-rad"):
            _text(total, "input", source)
        actuator = SubElement(channel, "actuator", name=f"fcs/{name}-position-rad")
        _text(actuator, "input", f"fcs/{name}-total-rad")
        _actuator_dynamics(actuator, name, effects)
        if surface.limit is not None:
            clip = SubElement(actuator, "clipto")
            _text(clip, "min", -surface.limit)
            _text(clip, "max", surface.limit)
    throttle = aircraft.throttle
    if throttle is None:
        return
    gain = SubElement(channel, "pure_gain", name="fcs/thrust-lbs")
    _text(gain, "input", "fcs/throttle-cmd-norm")
    _text(gain, "gain", (throttle.max_thrust or 1.0) * _NEWTON)
    delay = effects.get("command_delay", {}).get("throttle", 0.0)
    if delay:
        _text(gain, "delay", delay)
    _text(gain, "output", "external_reactions/thrust/magnitude")


def _actuator_dynamics(actuator: Element, control: str, effects: Effects) -> None:
    tau, rate, delay = (effects.get(name, {}).get(control, 0.0) for name in EFFECTS[:3])
    if tau:
        _text(actuator, "lag", 1.0 / tau)
    if rate:
        _text(actuator, "rate_limit", rate)
    if delay:
        _text(actuator, "delay", delay)


def _aerodynamics(root: Element, aircraft: Aircraft, error: Mapping[str, float]) -> None:
    aerodynamics = SubElement(root, "aerodynamics")
    for coefficient in COEFFICIENTS:
        _coefficient(aerodynamics, aircraft, coefficient, error)
    stability = {"X": (("CL", "sin", 1.0), ("CD", "cos", -1.0)), "Z": (("CL", "cos", -1.0), ("CD", "sin", -1.0))}
    for axis in ("X", "Y", "Z"):
        total = SubElement(SubElement(aerodynamics, "axis", name=axis), "function", name=f"aero/force/{axis}")
        product = _product(total, "aero/qbar-psf", "metrics/Sw-sqft")
        if axis == "Y":
            _text(product, "property", "aero/coefficient/CY")
            continue
        parts = SubElement(product, "sum")
        for name, turn, sign in stability[axis]:
            part = _product(parts, f"aero/coefficient/{name}")
            _text(SubElement(part, turn), "property", "aero/alpha-rad")
            _text(part, "value", sign)
    for axis, name, length in (("ROLL", "Cl", "bw-ft"), ("PITCH", "Cm", "cbarw-ft"), ("YAW", "Cn", "bw-ft")):
        total = SubElement(SubElement(aerodynamics, "axis", name=axis), "function", name=f"aero/moment/{axis}")
        _product(total, "aero/qbar-psf", "metrics/Sw-sqft", f"metrics/{length}", f"aero/coefficient/{name}")


def _coefficient(aerodynamics: Element, aircraft: Aircraft, coefficient: str, error: Mapping[str, float]) -> None:
    """One coefficient as a sum of derivatives times regressors."""
    function = SubElement(aerodynamics, "function", name=f"aero/coefficient/{coefficient}")
    total = SubElement(function, "sum")
    _text(total, "value", 0.0)
    positions = {c.symbol: (f"fcs/{name}-position-rad",) for name, c in aircraft.controls.items()}
    speed = aircraft.reference.airspeed / 0.3048
    for name, derivative in aircraft.derivatives.items():
        belongs, regressor = split_derivative(name)
        if belongs != coefficient:
            continue
        value = derivative.value + error.get(name, 0.0)
        if regressor == "0":
            _text(total, "value", value)
        elif regressor == "V":
            _text(_product(total, "velocities/vt-fps"), "value", value / speed)
        else:
            _text(_product(total, *{**_REGRESSORS, **positions}[regressor]), "value", value)
    for table in aircraft.tables:
        if table.coefficient == coefficient:
            _table(total, table, positions)


#: What a table may be over: JSBSim's property, and its units in one of ours.
_VARIABLES = {
    "alpha": ("aero/alpha-rad", 1.0),
    "beta": ("aero/beta-rad", 1.0),
    "V": ("velocities/vt-fps", 1.0 / 0.3048),
    "Mach": ("velocities/mach", 1.0),
    "throttle": ("fcs/throttle-cmd-norm", 1.0),
}


def _table(parent: Element, table: LookupTable, positions: Mapping[str, tuple[str, ...]]) -> None:
    """A lookup table. Raises InputError where it is over a rate, which JSBSim has in other units."""
    variables = {**_VARIABLES, **{symbol: (place, 1.0) for symbol, (place,) in positions.items()}}
    element = SubElement(parent, "table")
    scales = []
    for over, lookup in zip(table.over, ("row", "column"), strict=False):
        if over not in variables:
            raise InputError(
                f"table over {over!r}: cannot be exported to jsbsim; those that can: {', '.join(variables)}"
            )
        place, scale = variables[over]
        scales.append(scale)
        _text(element, "independentVar", place, lookup=lookup)
    rows = [[x * scales[0]] for x in table.points[0]]
    for row, values in zip(rows, table.values, strict=True):
        row.extend(values if isinstance(values, tuple) else (values,))
    lines = [" ".join(map(repr, row)) for row in rows]
    if len(table.over) == 2:
        lines.insert(0, " ".join(repr(x * scales[1]) for x in table.points[1]))
    SubElement(element, "tableData").text = "\n" + "\n".join(lines) + "\n"  # a row a line


def _product(parent: Element, *properties: str) -> Element:
    product = SubElement(parent, "product")
    for name in properties:
        _text(product, "property", name)
    return product
