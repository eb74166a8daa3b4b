"""Flight close to the ground."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="ground_effect",
    station="aerodynamics",
    summary="The ground holds the downwash up: more lift, less induced drag, nose-down moment.",
    equation=(
        "g = 1 / (1 + (16 h/b)^2), h = height + climb since the start; CL' = CL (1 + lift g), "
        "CD' = CD - drag g CL^2, Cm' = Cm - moment g CL"
    ),
    source="McCormick (1995), Aerodynamics, Aeronautics and Flight Mechanics (factor of induced drag)",
    parameters=fixed(
        SimulationParameter("lift", "1", "lift gained at the ground, share", 0.2, lower=0.0, upper=2.0),
        SimulationParameter("drag", "1", "induced drag lost at the ground, per CL^2", 0.05, lower=0.0, upper=1.0),
        SimulationParameter("moment", "1", "nose-down moment at the ground, per CL", 0.05, lower=0.0, upper=1.0),
        SimulationParameter("height", "m", "height above the ground at the start", 0.5, 0.5, 0.0, 20000.0, False),
    ),
)


def share(values: Values, climb: Scalar, span: Scalar) -> Scalar:
    """g: 1 at the ground, 0 far above; climb (m) since the start. Below the ground it is 1."""
    ratio = 16.0 * jnp.maximum(values["height"] + climb, 0.0) / span
    return 1.0 / (1.0 + ratio * ratio)


def lift(values: Values, g: Scalar, lift: Scalar) -> Scalar:
    """Added CL."""
    return values["lift"] * g * lift


def drag(values: Values, g: Scalar, lift: Scalar) -> Scalar:
    """Added CD."""
    return -values["drag"] * g * lift * lift


def pitching_moment(values: Values, g: Scalar, lift: Scalar) -> Scalar:
    """Added Cm."""
    return -values["moment"] * g * lift
