"""The loads of the plugin AdvancedLiftDrag of gz-sim (src/systems/advanced_lift_drag): a whole aircraft at one place.

Its axes for coefficients are forward-right-down. Versions before the fix of gz-sim's pull request 3817 drop Cem0 and
Cema; here they count.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.sim.importing.gazebo.numbers import number_in, positive_in, vector_in

Array = NDArray[np.float64]

_NAMES = ("CL", "CD", "CY", "Cell", "Cem", "Cen")

#: Sharpness of the blending at stall, and the flat plate's drag over aspect ratio: constants of the plugin.
_SHARPNESS, _PLATE = 15.0, (-0.224, -0.115)


@dataclass(frozen=True)
class AdvancedLiftDrag:
    """The plugin's parameters. ``joints`` has each joint's coefficients (6,) per rad, its direction in them."""

    link: str
    place: Array
    values: Mapping[str, float]
    joints: Mapping[str, Array]

    @classmethod
    def of(cls, plugin: Element, file: str) -> AdvancedLiftDrag:
        """The parameters of an SDF element. Raises InputError."""
        names = [f"{c}{x}" for c in _NAMES for x in ("a", "b", "p", "q", "r")]
        values = {name: number_in(plugin, name, 0.0, file) for name in (*names, "CL0", "CD0", "Cem0", "mac")}
        defaults = {"alpha_stall": np.pi / 2.0, "Cema_stall": 0.0}
        values |= {name: number_in(plugin, name, value, file) for name, value in defaults.items()}
        sizes = {"AR": 0.0, "eff": 0.0, "area": 1.0, "air_density": 1.2041}
        values |= {name: positive_in(plugin, name, value, file) for name, value in sizes.items()}
        joints: dict[str, Array] = {}
        for surface in plugin.findall("control_surface"):
            name = (surface.findtext("name") or "").strip()
            direction = number_in(surface, "direction", 1.0, file)
            per_degree = np.array([number_in(surface, f"{c}_ctrl", 0.0, file) for c in _NAMES])
            joints[name] = joints.get(name, np.zeros(6)) + direction * np.rad2deg(per_degree)
        place = vector_in(plugin, "cp", (0.0, 0.0, 0.0), file)
        return cls((plugin.findtext("link_name") or "").strip(), place, values, joints)

    @property
    def span(self) -> float:
        """Span, m."""
        return float(np.sqrt(self.values["area"] * self.values["AR"]))

    @property
    def chord(self) -> float:
        """Mean chord, m: area over span where the file gives none."""
        return self.values["mac"] if abs(self.values["mac"]) > 1e-9 else self.values["area"] / self.span

    def load(self, velocity: Array, rates: Array, joints: Mapping[str, Array]) -> tuple[Array, Array]:
        """Force (N, 3) at the plugin's place and moment (N, 3), forward-right-down.

        ``velocity`` (N, 3) m/s of the place and ``rates`` (N, 3) rad/s are forward-right-down; ``joints`` are angles.
        """
        v = self.values
        alpha, beta = np.arctan2(velocity[:, 2], velocity[:, 0]), np.arctan2(velocity[:, 1], velocity[:, 0])
        speed = np.hypot(velocity[:, 0], velocity[:, 2])  # in the plane of symmetry: what the plugin takes
        control = sum(
            (np.outer(joints[name], per_radian) for name, per_radian in self.joints.items()), np.zeros((1, 6))
        )
        lengths = np.array([self.span, self.chord, self.span]) / 2.0
        reduced = rates * lengths / speed[:, None]
        rate_terms = reduced @ np.array([[v[f"{c}{axis}"] for c in _NAMES] for axis in "pqr"])
        steady = self._steady(alpha, beta, control)
        c = steady + rate_terms
        scale = 0.5 * v["air_density"] * speed**2 * v["area"]
        sin, cos = np.sin(alpha), np.cos(alpha)
        force = np.column_stack([c[:, 0] * sin - c[:, 1] * cos, c[:, 2], -c[:, 0] * cos - c[:, 1] * sin])
        moment = c[:, 3:] * np.array([self.span, self.chord, self.span])
        return scale[:, None] * force, scale[:, None] * moment

    def _steady(self, alpha: Array, beta: Array, control: Array) -> Array:
        """Coefficients (N, 6) without rates."""
        v = self.values
        sigma = blending(alpha, v["alpha_stall"])
        plate = 2.0 * np.sign(alpha) * np.sin(alpha) ** 2 * np.cos(alpha)
        lift = (1.0 - sigma) * (v["CL0"] + v["CLa"] * alpha) + sigma * plate + v["CLb"] * beta + control[:, 0]
        induced = lift**2 / (np.pi * v["AR"] * v["eff"])
        drag = (1.0 - sigma) * (v["CD0"] + induced) + sigma * flat_plate_drag(alpha, v["AR"])
        attached = np.clip(alpha, -v["alpha_stall"], v["alpha_stall"])
        pitch = v["Cem0"] + v["Cema"] * attached + v["Cema_stall"] * (alpha - attached) + v["Cemb"] * beta
        lateral = [v[f"{n}a"] * alpha + v[f"{n}b"] * beta for n in ("CY", "Cell", "Cen")]
        columns = [lift, drag + control[:, 1], lateral[0] + control[:, 2], lateral[1] + control[:, 3]]
        return np.column_stack([*columns, pitch + control[:, 4], lateral[2] + control[:, 5]])


def blending(alpha: Array, stall: float) -> Array:
    """0 in attached flow, 1 beyond the angle of stall (rad)."""
    below, above = np.exp(-_SHARPNESS * (alpha - stall)), np.exp(_SHARPNESS * (alpha + stall))
    return np.asarray((1.0 + below + above) / ((1.0 + below) * (1.0 + above)))


def flat_plate_drag(alpha: Array, ratio: float) -> Array:
    """Drag coefficient beyond stall of a wing of an aspect ratio."""
    flat = 2.0 / (1.0 + np.exp(_PLATE[0] + _PLATE[1] * max(ratio, 1.0 / ratio)))
    return np.asarray(np.abs(flat * (0.5 - 0.5 * np.cos(2.0 * alpha))))
