"""Station ``mass``: from forces and moments to accelerations."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.body import MassProperties, Vector, angular_acceleration
from sysid_node.sim.effects import cg_shift, inertia_error, mass_error
from sysid_node.sim.model.layout import Model, Values


def properties(model: Model, effects: dict[str, Values]) -> MassProperties:
    """Mass, CG and inertia as they are."""
    return MassProperties(
        mass_error.apply(effects["mass_error"], model.mass),
        cg_shift.shift(effects["cg_shift"]),
        *inertia_error.apply(effects["inertia_error"], model.inertia),
    )


def nominal(model: Model) -> MassProperties:
    """Mass, CG and inertia as the file has them."""
    zero = jnp.zeros_like(model.mass)
    return MassProperties(model.mass, Vector(zero, zero, zero), *model.inertia)


def accelerations(body: MassProperties, rates: Vector, force: Vector, moment: Vector) -> tuple[Vector, Vector]:
    """Specific force at the CG (m/s^2) and angular acceleration (rad/s^2); moment about the file's CG."""
    about_cg = moment.minus(body.cg.cross(force))
    return force.times(1.0 / body.mass), angular_acceleration(body, rates, about_cg)
