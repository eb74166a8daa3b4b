"""First-order lag of every actuator."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.effects.base import Effect, Parameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="actuator_lag",
    station="actuator",
    summary="Surfaces follow their commands with a first-order lag.",
    equation="time_constant dx/dt + x = u, solved exactly for u linear between samples",
    source="Stevens, Lewis & Johnson (2016), Aircraft Control and Simulation (actuators of the F-16 model)",
    parameters=fixed(Parameter("time_constant", "s", "time constant", 0.05, lower=0.0, upper=1.0)),
)


def advance(values: Values, x: Scalar, u0: Scalar, u1: Scalar, step: Scalar) -> Scalar:
    """The lagged position (rad) one step (s) later, as the command goes from u0 to u1 (rad)."""
    return first_order(values["time_constant"], x, u0, u1, step)


def first_order(tau: Scalar, x: Scalar, u0: Scalar, u1: Scalar, step: Scalar) -> Scalar:
    """x one step later by tau dx/dt + x = u, exact for u linear in time.

    At tau = 0 it is u1, and its derivative with respect to tau is that of a delay.
    """
    decay = jnp.exp(-step / jnp.maximum(tau, step / 50.0))
    ramp = tau / step * (1.0 - decay)
    return decay * x + (ramp - decay) * u0 + (1.0 - ramp) * u1
