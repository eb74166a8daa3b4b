"""One elastic mode of the airframe, measured by the inertial sensors."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.effects.actuator_lag import advance as follow
from sysid_node.sim.effects.actuator_lag import transition
from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="structural_mode",
    station="structure",
    summary="The fuselage or wing rings after manoeuvres: the IMU feels it, the flight path does not.",
    equation=(
        "d2x/dt2 + 2 damping w dx/dt + w^2 x = az, w = 2 pi frequency; az' = az + gain d2x/dt2, q' = q + slope dx/dt"
    ),
    source="Waszak & Schmidt (1988), J. Aircraft 25(6) (mean axes, one in-vacuo mode)",
    parameters=fixed(
        SimulationParameter("gain", "1", "modal acceleration felt along body z", 0.3, lower=-5.0, upper=5.0),
        SimulationParameter("slope", "rad/m", "modal slope felt as pitch rate", 1.0, lower=-20.0, upper=20.0),
        SimulationParameter("frequency", "Hz", "natural frequency", 2.0, 8.0, 0.5, 40.0, False),
        SimulationParameter("damping", "1", "damping ratio", 0.02, 0.05, 0.001, 1.0, False),
    ),
)


def advance(values: Values, x: Scalar, v: Scalar, load0: Scalar, load1: Scalar, step: Scalar) -> tuple[Scalar, Scalar]:
    """Displacement (m) and speed (m/s) one step (s) later, as the force along z goes from load0 to load1 (m/s^2).

    Exact for a force linear in time, whatever the step: the mode is a lag of second order that follows its steady
    displacement.
    """
    past = transition(0.5 / (jnp.pi * values["frequency"]), values["damping"], step)
    return follow(past, x, v, steady(values, load0), steady(values, load1), step)


def acceleration(values: Values, x: Scalar, v: Scalar, load: Scalar) -> Scalar:
    """The modal acceleration (m/s^2) at a displacement (m), a speed (m/s) and a specific force along z (m/s^2)."""
    w = 2.0 * jnp.pi * values["frequency"]
    return load - 2.0 * values["damping"] * w * v - w * w * x


def steady(values: Values, load: Scalar) -> Scalar:
    """The modal displacement (m) at rest under a specific force along z (m/s^2)."""
    w = 2.0 * jnp.pi * values["frequency"]
    return load / (w * w)


def felt(values: Values, acceleration: Scalar, speed: Scalar) -> tuple[Scalar, Scalar]:
    """Added specific force along z (m/s^2) and pitch rate (rad/s)."""
    return values["gain"] * acceleration, values["slope"] * speed
