"""The aircraft as a model of Gazebo (gz-sim): masses, surfaces with their servos, a rotor, and AdvancedLiftDrag.

The plugin takes control derivatives per degree of each joint, and drag as a parabola of lift with an efficiency; its
moments are about ``cp``, here the link's origin, which is the aircraft file's centre of gravity. A shift of the latter
is in the link's inertial pose. Joints are those of the aircraft file. The model has no shapes.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import split_derivative
from sysid_node.sim.export.cells import finite, plain
from sysid_node.sim.export.exported import Exported
from sysid_node.sim.export.folding import FOLDED, Effects, folded
from sysid_node.sim.export.gazebo.fit import GazeboNumbers, gazebo_numbers
from sysid_node.sim.export.gazebo.parts import add_masses, add_rotor, add_servos, joint_angles, parts_left_out
from sysid_node.sim.export.losses import differences, late_failures, not_held
from sysid_node.sim.export.steady import Coefficients, Columns, SteadyModel
from sysid_node.sim.importing.gazebo.read import gazebo_plant
from sysid_node.sim.importing.plant import PlantStates, nondimensional

Array = NDArray[np.float64]

#: The plugin's name of each coefficient.
NAMES = {"CL": "CL", "CD": "CD", "CY": "CY", "Cl": "Cell", "Cm": "Cem", "Cn": "Cen"}

_RATES = ("p", "q", "r")

_NOTE = (
    " Written by sysid export. The origin of base_link is the aircraft file's centre of gravity, x forward, z up; add"
    " shapes, sensors and your autopilot's plugins. Versions of gz-sim before the fix of July 2026"
    " (gazebosim/gz-sim pull request 3817) drop the pitching moment of alpha. "
)

#: How often the numbers are corrected by what the written model has; each time far less is left.
_CORRECTIONS = 3

#: Effects that the model holds; those in steady flight as far as ``differences`` does not say otherwise.
HELD = (
    "actuator_lag", "actuator_rate_limit", "actuator_bias", "stuck_surface", "control_effectiveness_loss", "motor_lag",
    "cg_shift", "thrust_scale", "thrust_yaw", "lateral_asymmetry", "lateral_alpha_coupling", "drag_rise",
    "control_nonlinearity", "nonlinear_pitching_moment", "propwash",
)  # fmt: skip

WHY = {
    "command_delay": "Gazebo's joints and motors have no delay",
    "actuator_backlash": "Gazebo's joint controllers have no free play",
    "unsteady_aerodynamics": "the plugin has no terms in the rate of alpha",
    "stall_separation": "its memory (tau1, tau2); of its steady curve what the plugin's alpha_stall gives",
    "ground_effect": "the plugin has none",
    "structural_mode": "the model is rigid",
    "thrust_line_offset": "the aircraft has no throttle",
}


def gazebo_model(aircraft: Aircraft, effects: Effects | None = None) -> Exported:
    """SDF of the model, and what it does not hold. Raises InputError where a number is not finite."""
    aircraft, rest = folded(aircraft, effects or {})
    file = SteadyModel(aircraft, rest)
    inner = SteadyModel(aircraft, {name: values for name, values in rest.items() if name != "cg_shift"})
    plugin = _plugin_of(inner)
    text = _document(inner, rest, plugin)
    written = read_back(text, aircraft)
    for _ in range(_CORRECTIONS if not file.plain else 0):
        plugin = _corrected(plugin, file, written)
        text = _document(inner, rest, plugin)
        written = read_back(text, aircraft)
    lines = [*parts_left_out(aircraft, rest), *not_held(rest, HELD, WHY), *late_failures(rest)]
    lines += _offsets(inner) + differences(file, written)
    return Exported(text, tuple(explained(line) for line in lines), frozenset((*HELD, *FOLDED, "stall_separation")))


@dataclass(frozen=True)
class _Plugin:
    """The plugin's numbers over alpha, and its slopes over everything else by derivative's name."""

    numbers: GazeboNumbers
    slopes: dict[str, float]


def _plugin_of(file: SteadyModel) -> _Plugin:
    numbers, slopes = gazebo_numbers(file), dict(file.derivatives)
    for symbol in file.aircraft.control_symbols:  # the parabola has this part of the slope of drag
        shared = 2.0 * numbers.fitted * numbers.lift * slopes.get(f"CL_{symbol}", 0.0)
        slopes[f"CD_{symbol}"] = slopes.get(f"CD_{symbol}", 0.0) - shared
    return _Plugin(numbers, slopes)


def _corrected(plugin: _Plugin, file: SteadyModel, written: Coefficients) -> _Plugin:
    """The numbers with what the written model's slopes and level flight lack of the file's.

    They lack something where the plugin's place is not the centre of gravity: it takes the flow of its own place.
    """
    slopes, numbers = dict(plugin.slopes), plugin.numbers
    for name in file.regressors:
        change = file.slope(file, name) - file.slope(written, name)
        for coefficient, value in zip(NAMES, change.tolist(), strict=True):
            if not (coefficient == "CD" and name in ("alpha", "beta")):
                slopes[f"{coefficient}_{name}"] = slopes.get(f"{coefficient}_{name}", 0.0) + value
    if not file.bent:
        numbers = replace(numbers, CLa=slopes["CL_alpha"], Cema=slopes["Cm_alpha"])
    # the changes of slopes change level flight, too
    moved = {c: sum((slopes.get(f"{c}_{n}", 0.0) - plugin.slopes.get(f"{c}_{n}", 0.0)) * file.level[n]
                    for n in file.regressors if n != "alpha" or not file.bent) for c in NAMES}  # fmt: skip
    missing = dict(zip(NAMES, (file.here(file) - file.here(written)).tolist(), strict=True))
    moved["CD"] = sum((slopes.get(f"CD_{n}", 0.0) - plugin.slopes.get(f"CD_{n}", 0.0)) * file.level[n]
                      for n in file.regressors if n != "alpha")  # fmt: skip
    numbers = replace(
        numbers,
        CL0=numbers.CL0 + missing["CL"] - moved["CL"],
        CD0=numbers.CD0 + missing["CD"] - moved["CD"],
        Cem0=numbers.Cem0 + missing["Cm"] - moved["Cm"],
    )
    return _Plugin(numbers, slopes)


def explained(line: str) -> str:
    """A line with the reason of what it says."""
    if line.startswith("beta from"):
        return f"{line} (the plugin's pressure is that of the airspeed in the plane of symmetry)"
    return line


def _document(file: SteadyModel, rest: Effects, numbers_: _Plugin) -> str:
    aircraft = file.aircraft
    root = Element("model", name=plain(aircraft.name))
    root.append(Comment(_NOTE))
    base = SubElement(root, "link", name="base_link")
    surfaces = add_servos(root, aircraft, rest)
    rotor = add_rotor(root, file, rest)
    add_masses(base, aircraft, rest.get("cg_shift", {}), [*surfaces, *rotor])
    name = "gz::sim::systems::AdvancedLiftDrag"
    plugin = SubElement(root, "plugin", filename="gz-sim-advanced-lift-drag-system", name=name)
    numbers = numbers_.numbers
    for tag, value in (_airframe(aircraft, numbers) | _stability(numbers_)).items():
        SubElement(plugin, tag).text = value if isinstance(value, str) else f"{finite(value):.12g}"
    joints = _surfaces(aircraft, numbers_.slopes)
    SubElement(plugin, "num_ctrl_surfaces").text = str(len(joints))
    for index, (joint, values) in enumerate(joints.items()):
        surface = SubElement(plugin, "control_surface")
        SubElement(surface, "name").text = plain(joint)
        SubElement(surface, "index").text = str(index)
        for tag, number in {"direction": 1.0, **values}.items():
            SubElement(surface, tag).text = f"{finite(number):.12g}"
    indent(root, "  ")
    return tostring(root, encoding="unicode") + "\n"


def _airframe(aircraft: Aircraft, numbers: GazeboNumbers) -> dict[str, str | float]:
    geometry = aircraft.geometry
    ratio = geometry.b**2 / geometry.S
    return {
        "link_name": "base_link",
        "cp": f"{finite(numbers.cp[0]):.12g} 0 {finite(-numbers.cp[1]):.12g}",
        "forward": "1 0 0",
        "upward": "0 0 1",
        "air_density": aircraft.reference.air_density,
        "area": geometry.S,
        "mac": geometry.cbar,
        "AR": ratio,
        "CD0": numbers.CD0,
        "eff": 1.0 / (math.pi * ratio * numbers.factor) if numbers.factor > 0.0 else 1e9,
        "alpha_stall": numbers.alpha_stall,
        "Cema_stall": numbers.Cema_stall,
    }


def _stability(plugin: _Plugin) -> dict[str, float]:
    """Stability derivatives by the plugin's names; the drag due to alpha is in the parabola."""
    numbers = plugin.numbers
    entries = {"CL0": numbers.CL0, "Cem0": numbers.Cem0}
    for coefficient, name in NAMES.items():
        for regressor, suffix in {"alpha": "a", "beta": "b", **{rate: rate for rate in _RATES}}.items():
            if coefficient == "CD" and regressor in ("alpha", "beta"):
                continue
            entries[name + suffix] = plugin.slopes.get(f"{coefficient}_{regressor}", 0.0)
    return entries | {"CLa": numbers.CLa, "Cema": numbers.Cema}


def _surfaces(aircraft: Aircraft, slopes: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Control derivatives by joint and plugin's name, per degree of the joint."""
    surfaces: dict[str, dict[str, float]] = {}
    for control in aircraft.controls.values():
        for joint, scale in control.joints.items():
            entries = surfaces.setdefault(joint, {f"{name}_ctrl": 0.0 for name in NAMES.values()})
            for coefficient, name in NAMES.items():
                entries[f"{name}_ctrl"] += (
                    math.radians(1.0) * scale * slopes.get(f"{coefficient}_{control.symbol}", 0.0)
                )
    return surfaces


def _offsets(file: SteadyModel) -> list[str]:
    """Offsets out of the plane of symmetry, for which the plugin has no number."""
    lost = [f"{name} {value:.3g}" for name, value in file.derivatives.items()
            if split_derivative(name) in (("CY", "0"), ("Cl", "0"), ("Cn", "0")) and abs(value) > 2e-6]  # fmt: skip
    return [f"{', '.join(lost)}: the plugin has no offsets of side force, roll and yaw"] if lost else []


def read_back(text: str, aircraft: Aircraft) -> Coefficients:
    """The coefficients of the written model about its centre of gravity, by the equations of the plugin."""
    with tempfile.TemporaryDirectory(prefix="sysid-") as folder:
        path = Path(folder) / "model.sdf"
        path.write_text(text, encoding="utf-8")
        plant = gazebo_plant(path)
    g = aircraft.geometry

    def coefficients(x: Columns) -> Array:
        half = 2.0 * x["V"]
        rates = (x["p"] * half / g.b, x["q"] * half / g.cbar, x["r"] * half / g.b)
        angles = joint_angles(aircraft, x)
        controls = {c.symbol: sum((scale * angles[joint] for joint, scale in c.joints.items()), 0.0 * half)
                    for c in plant.controls.values()}  # fmt: skip
        states = PlantStates(x["V"], x["alpha"], x["beta"], *rates, controls, np.zeros_like(x["V"]))
        return nondimensional(plant.air(states), plant.density, states, g)

    return coefficients
