"""Station ``propulsion``: thrust and its moments."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.dynamics.forces import thrust_axes
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects import motor_lag, thrust_line_offset, thrust_scale, thrust_yaw
from sysid_node.sim.model.layout import AircraftNumbers, Scalar, Values


def commanded(model: AircraftNumbers, thrust: Scalar) -> Scalar:
    """The commanded thrust (N) within the motor's limits."""
    return jnp.clip(thrust, 0.0, model.max_thrust)


def throttle(model: AircraftNumbers, state: Scalar) -> Scalar:
    """The throttle (0..1) that belongs to the motor's thrust (N); zero where the file states no largest thrust."""
    return state / model.max_thrust


def advance(effects: dict[str, Values], state: Scalar, command0: Scalar, command1: Scalar, step: Scalar) -> Scalar:
    """The motor's thrust (N) one sample (``step`` s) later."""
    return motor_lag.advance(effects["motor_lag"], state, command0, command1, step)


def thrust(effects: dict[str, Values], state: Scalar) -> Scalar:
    """Thrust (N) with its scale error, from the motor's."""
    return thrust_scale.apply(effects["thrust_scale"], state)


def load(model: AircraftNumbers, effects: dict[str, Values], thrust: Scalar, alpha: Scalar) -> tuple[Vector, Vector]:
    """Force (N) and moment about the file's CG (N m), body axes."""
    forward, down = thrust_axes(model.thrust_inclination, jnp)
    force = Vector(thrust * forward, jnp.zeros_like(thrust), thrust * down)
    moment = Vector(
        thrust_yaw.rolling_moment(effects["thrust_yaw"], thrust),
        model.thrust_arm * thrust + thrust_line_offset.pitching_moment(effects["thrust_line_offset"], thrust),
        thrust_yaw.yawing_moment(effects["thrust_yaw"], thrust, alpha),
    )
    return force, moment
