"""The loads of one plugin LiftDrag of gz-sim (src/systems/lift_drag/LiftDrag.cc): a lifting surface at its place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.sim.importing.gazebo.numbers import number_in, positive_in, vector_in

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LiftDrag:
    """The plugin's parameters, with gz-sim's defaults. Axes of the link, forward-left-up; rad, SI."""

    link: str
    place: Array
    forward: Array
    upward: Array
    area: float
    density: float
    alpha0: float
    slopes: Mapping[str, float]  # cla, cda before stall; cla_stall, cda_stall after it
    alpha_stall: float
    joint: str
    joint_to_lift: float

    @classmethod
    def of(cls, plugin: Element, file: str) -> LiftDrag:
        """The parameters of an SDF element. Raises InputError."""
        defaults = {"cla": 1.0, "cda": 0.01, "cla_stall": 0.0, "cda_stall": 1.0}
        return cls(
            link=(plugin.findtext("link_name") or "").strip(),
            place=vector_in(plugin, "cp", (0.0, 0.0, 0.0), file),
            forward=_unit(vector_in(plugin, "forward", (1.0, 0.0, 0.0), file)),
            upward=_unit(vector_in(plugin, "upward", (0.0, 0.0, 1.0), file)),
            area=positive_in(plugin, "area", 1.0, file),
            density=positive_in(plugin, "air_density", 1.2041, file),
            alpha0=number_in(plugin, "a0", 0.0, file),
            slopes={name: number_in(plugin, name, value, file) for name, value in defaults.items()},
            alpha_stall=number_in(plugin, "alpha_stall", np.pi / 2.0, file),
            joint=(plugin.findtext("control_joint_name") or "").strip(),
            joint_to_lift=number_in(plugin, "control_joint_rad_to_cl", 4.0, file),
        )

    def force(self, velocity: Array, deflection: Array | float) -> Array:
        """Force (N, 3) at the plugin's place, N, of the velocity (N, 3) there (m/s) and the joint's angle (N,), rad.

        The factor that the source calls the cosine of sweep is the square of it; lift by the joint does not have it.
        """
        span = _unit(np.cross(self.forward, self.upward))
        speed = np.linalg.norm(velocity, axis=1)
        sweep = (velocity @ span) / speed
        in_plane = velocity - np.outer(velocity @ span, span)
        within = np.linalg.norm(in_plane, axis=1)
        along = in_plane / within[:, None]
        lift_axis = np.cross(np.broadcast_to(span, along.shape), along)
        turn = np.arccos(np.clip(lift_axis @ self.upward, -1.0, 1.0))
        alpha = self.alpha0 + np.where(lift_axis @ self.forward >= 0.0, turn, -turn)
        alpha = np.where(np.abs(alpha) > 0.5 * np.pi, alpha - np.pi * np.sign(alpha), alpha)
        share = 1.0 - sweep**2
        lift = self._lift(alpha) * share + (self.joint_to_lift * deflection if self.joint else 0.0)
        drag = np.abs(self._curve(alpha, "cda") * share)
        pressure = 0.5 * self.density * within**2 * self.area
        return np.asarray((pressure * lift)[:, None] * lift_axis - (pressure * drag)[:, None] * along)

    def _lift(self, alpha: Array) -> Array:
        """Lift coefficient of the section; beyond stall it does not change its sign."""
        curve = self._curve(alpha, "cla")
        curve = np.where(alpha > self.alpha_stall, np.maximum(curve, 0.0), curve)
        return np.where(alpha < -self.alpha_stall, np.minimum(curve, 0.0), curve)

    def _curve(self, alpha: Array, name: str) -> Array:
        before, after, stall = self.slopes[name], self.slopes[f"{name}_stall"], self.alpha_stall
        inner = np.clip(alpha, -stall, stall)
        return np.asarray(before * inner + after * (alpha - inner))


def _unit(vector: Array) -> Array:
    size = float(np.linalg.norm(vector))
    return vector / size if size > 0.0 else vector
