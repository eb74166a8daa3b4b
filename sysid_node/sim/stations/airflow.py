"""Station ``airflow``: the air as the aircraft meets it."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp

from sysid_node.sim.body import Vector
from sysid_node.sim.effects import gust, turbulence
from sysid_node.sim.model.layout import Model, Scalar, Values


class Air(NamedTuple):
    """Flow at the CG: velocity relative to the air (body axes) and what derives from it."""

    velocity: Vector  # m/s
    rates: Vector  # rad/s, relative to the rotating air
    speed: Scalar  # m/s
    alpha: Scalar  # rad
    beta: Scalar  # rad
    density: Scalar  # kg/m^3

    @property
    def pressure(self) -> Scalar:
        """Dynamic pressure, N/m^2."""
        return 0.5 * self.density * self.speed * self.speed


def gusts(model: Model, effects: dict[str, Values], given: Scalar, realisation: Scalar, time: Scalar) -> Scalar:
    """Gusts (..., 6) at a time (s): velocity of the air along body axes (m/s), its rotation (rad/s)."""
    total = turbulence.apply(effects["turbulence"], given, realisation)
    return gust.apply(effects["gust"], total, time, model.airspeed)


def meet(velocity: Vector, rates: Vector, gusts: Scalar, density: Scalar) -> Air:
    """The flow, from the motion relative to the steadily moving air and the gusts (6,)."""
    relative = velocity.minus(Vector(gusts[0], gusts[1], gusts[2]))
    turning = rates.minus(Vector(gusts[3], gusts[4], gusts[5]))
    speed, alpha, beta = flow_angles(relative)
    return Air(relative, turning, speed, alpha, beta, density)


def flow_angles(velocity: Vector) -> tuple[Scalar, Scalar, Scalar]:
    """Airspeed (m/s), alpha = atan(w/u), beta = asin(v/V) (rad) of a velocity relative to the air."""
    u, v, w = velocity
    forward = jnp.sqrt(u * u + w * w)
    return jnp.sqrt(forward * forward + v * v), jnp.arctan2(w, u), jnp.arctan2(v, forward)


def velocity_of(speed: Scalar, alpha: Scalar, beta: Scalar) -> Vector:
    """The velocity relative to the air (m/s) of an airspeed and flow angles (rad)."""
    forward = speed * jnp.cos(beta)
    return Vector(forward * jnp.cos(alpha), speed * jnp.sin(beta), forward * jnp.sin(alpha))
