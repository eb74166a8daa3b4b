"""The aircraft as the plugin AdvancedLiftDrag of Gazebo (gz-sim), to be put into a model's SDF.

The plugin takes control derivatives per degree of each joint, and drag as a parabola of lift with an efficiency; its
moments are about ``cp``, here the link's origin, which is to lie in the centre of gravity. Joints are those of the
aircraft file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.sim.export.cells import finite, plain
from sysid_node.sim.export.polar import polar_of

#: The plugin's name of each coefficient.
_NAMES = {"CL": "CL", "CD": "CD", "CY": "CY", "Cl": "Cell", "Cm": "Cem", "Cn": "Cen"}

_RATES = ("p", "q", "r")

_NOTE = (
    " Written by sysid export. Put this into a model whose link base_link has its origin in the centre of gravity,"
    " x forward, z up. Versions of gz-sim before the fix of July 2026 (gazebosim/gz-sim pull request 3817) drop the"
    " pitching moment of alpha. "
)


def gazebo_plugin(aircraft: Aircraft, effects: Mapping[str, Mapping[str, float]] | None = None) -> str:
    """SDF of the plugin and of the link's inertia. Raises InputError for any effect: the plugin has none."""
    if effects:
        raise InputError(
            f"effect {next(iter(effects))!r} cannot be exported to gazebo: its plugin has derivatives only"
        )
    root = Element("model", name=plain(aircraft.name))
    root.append(Comment(_NOTE))
    _inertial(SubElement(root, "link", name="base_link"), aircraft)
    name = "gz::sim::systems::AdvancedLiftDrag"
    plugin = SubElement(root, "plugin", filename="gz-sim-advanced-lift-drag-system", name=name)
    for tag, value in (_airframe(aircraft) | _stability(aircraft)).items():
        SubElement(plugin, tag).text = value if isinstance(value, str) else f"{finite(value):.9g}"
    surfaces = _surfaces(aircraft)
    SubElement(plugin, "num_ctrl_surfaces").text = str(len(surfaces))
    for joint, values in surfaces.items():
        surface = SubElement(plugin, "control_surface")
        SubElement(surface, "name").text = plain(joint)
        for tag, number in {"direction": 1.0, **values}.items():
            SubElement(surface, tag).text = f"{finite(number):.9g}"
    indent(root, "  ")
    return tostring(root, encoding="unicode") + "\n"


def _inertial(link: Element, aircraft: Aircraft) -> None:
    """Mass and inertia, forward-left-up: there the tensor's xz entry is the usual Ixz itself."""
    inertial, inertia = SubElement(link, "inertial"), aircraft.inertia
    SubElement(inertial, "mass").text = f"{finite(aircraft.mass):.9g}"
    tensor = SubElement(inertial, "inertia")
    entries = {"ixx": inertia.Ixx, "ixy": 0.0, "ixz": inertia.Ixz, "iyy": inertia.Iyy, "iyz": 0.0, "izz": inertia.Izz}
    for tag, value in entries.items():
        SubElement(tensor, tag).text = f"{finite(value):.9g}"


def _airframe(aircraft: Aircraft) -> dict[str, str | float]:
    geometry, polar = aircraft.geometry, polar_of(aircraft)
    ratio = geometry.b**2 / geometry.S
    return {
        "link_name": "base_link",
        "cp": "0 0 0",
        "forward": "1 0 0",
        "upward": "0 0 1",
        "air_density": aircraft.reference.air_density,
        "area": geometry.S,
        "mac": geometry.cbar,
        "AR": ratio,
        "CD0": polar.zero,
        "eff": 1.0 / (math.pi * ratio * polar.factor) if polar.factor else 1e9,
    }


def _stability(aircraft: Aircraft) -> dict[str, float]:
    """Stability derivatives by the plugin's names; the drag due to alpha is in the parabola."""
    value = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    entries = {"CL0": value.get("CL_0", 0.0), "Cem0": value.get("Cm_0", 0.0)}
    for coefficient, name in _NAMES.items():
        for regressor, suffix in {"alpha": "a", "beta": "b", **{rate: rate for rate in _RATES}}.items():
            if coefficient == "CD" and regressor in ("alpha", "beta"):
                continue
            entries[name + suffix] = value.get(f"{coefficient}_{regressor}", 0.0)
    return entries


def _surfaces(aircraft: Aircraft) -> dict[str, dict[str, float]]:
    """Control derivatives by joint and plugin's name, per degree of the joint."""
    surfaces: dict[str, dict[str, float]] = {}
    for control in aircraft.controls.values():
        for joint, scale in control.joints.items():
            entries = surfaces.setdefault(joint, {f"{name}_ctrl": 0.0 for name in _NAMES.values()})
            for coefficient, name in _NAMES.items():
                derivative = aircraft.derivatives.get(f"{coefficient}_{control.symbol}")
                entries[f"{name}_ctrl"] += math.radians(1.0) * scale * (derivative.value if derivative else 0.0)
    return surfaces
