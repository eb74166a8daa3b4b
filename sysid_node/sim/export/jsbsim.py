"""The aircraft as a JSBSim model (JSBSim-ML 2.0).

Commands are ``fcs/<control>-cmd-rad`` (rad), to which JSBSim's usual
``fcs/<control>-cmd-norm`` is added as a share of the control's limit, and ``fcs/throttle-cmd-norm``. JSBSim's
structural axes run aft, right, up, and its product of inertia is minus the usual Ixz.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.sim.export.cells import finite, plain
from sysid_node.sim.export.exported import Exported
from sysid_node.sim.export.folding import FOLDED, Effects, folded
from sysid_node.sim.export.jsbsim_aerodynamics import add_aerodynamics
from sysid_node.sim.export.jsbsim_controls import add_flight_control
from sysid_node.sim.export.losses import late_failures, not_held

#: Effects that the model holds.
EFFECTS = (
    "actuator_lag", "actuator_rate_limit", "command_delay", "actuator_backlash", "actuator_bias", "stuck_surface",
    "control_effectiveness_loss", "cg_shift", "motor_lag", "propwash", "thrust_yaw", "control_nonlinearity",
    "nonlinear_pitching_moment", "unsteady_aerodynamics", "lateral_alpha_coupling", "lateral_asymmetry", "drag_rise",
    "stall_separation", *FOLDED,
)  # fmt: skip

_WHY = {"ground_effect": "the model's aerodynamics have none", "structural_mode": "the model is rigid"}


def jsbsim_model(aircraft: Aircraft, effects: Effects | None = None) -> str:
    """The model's XML. Raises InputError for an effect that is not in ``EFFECTS``, or an unknown moment of inertia."""
    effects = effects or {}
    unsupported = [name for name in effects if name not in EFFECTS]
    if unsupported:
        raise InputError(
            f"effect {unsupported[0]!r} cannot be exported to jsbsim; those that can: {', '.join(EFFECTS)}"
        )
    aircraft, rest = folded(aircraft, effects)
    root = Element("fdm_config", name=plain(aircraft.name), version="2.0", release="BETA")
    header = SubElement(root, "fileheader")
    _text(header, "author", "sysid export")
    _text(header, "description", aircraft.source or aircraft.name)
    _metrics(root, aircraft)
    _mass_balance(root, aircraft, rest.get("cg_shift", {}))
    SubElement(root, "ground_reactions")
    _thrust_force(root, aircraft)
    SubElement(root, "propulsion")
    add_flight_control(root, aircraft, rest)
    add_aerodynamics(root, aircraft, rest)
    indent(root, "  ")
    return '<?xml version="1.0"?>\n' + tostring(root, encoding="unicode") + "\n"


def export_jsbsim(aircraft: Aircraft, effects: Effects | None = None) -> Exported:
    """The model, and what it does not hold. Raises InputError for an unknown moment of inertia."""
    effects = effects or {}
    lines = [*not_held(effects, EFFECTS, _WHY), *late_failures(effects)]
    held = {name: values for name, values in effects.items() if name in EFFECTS}
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


def _thrust_force(root: Element, aircraft: Aircraft) -> None:
    """Thrust as a force on the body, its line below the CG by the arm."""
    throttle = aircraft.throttle
    if throttle is None:
        return
    along, up = math.cos(throttle.inclination), math.sin(throttle.inclination)
    force = SubElement(SubElement(root, "external_reactions"), "force", name="thrust", frame="BODY")
    # the arm is nose-up moment per newton: a line that far below the CG, measured across the thrust
    _location(force, throttle.arm * up, 0.0, throttle.arm * along)
    direction = SubElement(force, "direction")
    for axis, value in (("x", along), ("y", 0.0), ("z", -up)):
        _text(direction, axis, value)
