"""Station ``mass``: mass, centre of gravity and inertia."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.dynamics.rigid_body import MassProperties
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects import cg_shift, inertia_error, mass_error
from sysid_node.sim.model.layout import AircraftNumbers, Values


def properties(model: AircraftNumbers, effects: dict[str, Values]) -> MassProperties:
    """Mass (kg), CG (m) and inertia (kg m^2) with their effects."""
    return MassProperties(
        mass_error.apply(effects["mass_error"], model.mass),
        cg_shift.shift(effects["cg_shift"]),
        *inertia_error.apply(effects["inertia_error"], model.inertia),
    )


def nominal(model: AircraftNumbers) -> MassProperties:
    """Mass (kg), CG (m) and inertia (kg m^2) of the aircraft file."""
    zero = jnp.zeros_like(model.mass)
    return MassProperties(model.mass, Vector(zero, zero, zero), *model.inertia)
