"""Moments of inertia that differ from the file's."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

_AXES = ("Ixx", "Iyy", "Izz")

EFFECT = Effect(
    name="inertia_error",
    station="mass",
    summary="The moments of inertia differ from the file's.",
    equation="Ixx' = Ixx (1 + Ixx error), likewise Iyy, Izz; Ixz' = Ixz + (Ixz error) sqrt(Ixx Izz)",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 3 (equations of motion)",
    parameters=fixed(
        *(SimulationParameter(axis, "1", f"share of {axis}", 0.1, lower=-0.8, upper=5.0) for axis in _AXES),
        SimulationParameter("Ixz", "1", "share of sqrt(Ixx Izz) added to Ixz", 0.02, lower=-0.5, upper=0.5),
    ),
)


def apply(values: Values, inertia: Scalar) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Ixx, Iyy, Izz, Ixz (kg m^2) from the file's (4,)."""
    Ixx, Iyy, Izz, Ixz = inertia
    return (
        Ixx * (1.0 + values["Ixx"]),
        Iyy * (1.0 + values["Iyy"]),
        Izz * (1.0 + values["Izz"]),
        Ixz + values["Ixz"] * jnp.sqrt(Ixx * Izz),
    )
