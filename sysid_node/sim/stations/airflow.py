"""Station ``airflow``: the flow at the CG, gusts included."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp

from sysid_node.dynamics.airflow import flow_angles
from sysid_node.dynamics.atmosphere import dynamic_pressure
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects import gust, turbulence
from sysid_node.sim.model.layout import AircraftNumbers, Scalar, Values


class Air(NamedTuple):
    """Flow at the CG: velocity relative to the air in body axes, airspeed, flow angles and density."""

    velocity: Vector  # m/s
    rates: Vector  # rad/s, relative to the rotating air
    speed: Scalar  # m/s
    alpha: Scalar  # rad
    beta: Scalar  # rad
    density: Scalar  # kg/m^3

    @property
    def pressure(self) -> Scalar:
        """Dynamic pressure, N/m^2."""
        pressure: Scalar = dynamic_pressure(self.density, self.speed)
        return pressure


def gusts(
    model: AircraftNumbers, effects: dict[str, Values], given: Scalar, realisation: Scalar, time: Scalar
) -> Scalar:
    """Gusts (..., 6) at a time (s): velocity of the air along body axes (m/s), its rotation (rad/s)."""
    total = turbulence.apply(effects["turbulence"], given, realisation)
    return gust.apply(effects["gust"], total, time, model.airspeed)


def meet(velocity: Vector, rates: Vector, gusts: Scalar, density: Scalar) -> Air:
    """The flow, from velocity (m/s) and rates (rad/s) relative to the steadily moving air, and gusts (6,)."""
    relative = velocity.minus(Vector(gusts[0], gusts[1], gusts[2]))
    turning = rates.minus(Vector(gusts[3], gusts[4], gusts[5]))
    speed, alpha, beta = flow_angles(relative, jnp)
    return Air(relative, turning, speed, alpha, beta, density)
