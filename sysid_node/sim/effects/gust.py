"""One discrete gust."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="gust",
    station="airflow",
    summary="One 1-cosine gust, from rest to rest.",
    equation="gust' = gust + peak (1 - cos(2 pi V0 (t - start) / length)) / 2 over one length",
    source="MIL-F-8785C (1980), sec. 3.7.1.3 (discrete gust; here with its fall)",
    parameters=fixed(
        SimulationParameter("forward", "m/s", "peak of the air's velocity along body x", 2.0, lower=-30.0, upper=30.0),
        SimulationParameter("right", "m/s", "peak of the air's velocity along body y", 2.0, lower=-30.0, upper=30.0),
        SimulationParameter("down", "m/s", "peak of the air's velocity along body z", 2.0, lower=-30.0, upper=30.0),
        SimulationParameter("start", "s", "time at which it begins", 2.0, neutral=2.0, switch=False),
        SimulationParameter("length", "m", "its length", 20.0, neutral=30.0, lower=0.5, upper=2000.0, switch=False),
    ),
)


def apply(values: Values, gusts: Scalar, time: Scalar, airspeed: Scalar) -> Scalar:
    """Gusts (..., 6) plus the discrete one at a time (s); ``airspeed`` (m/s) is that of the reference condition."""
    phase = jnp.clip(airspeed * (time - values["start"]) / values["length"], 0.0, 1.0)
    shape = 0.5 * (1.0 - jnp.cos(2.0 * jnp.pi * phase))
    zero = jnp.zeros_like(shape)
    peak = jnp.stack([values["forward"] * shape, values["right"] * shape, values["down"] * shape, zero, zero, zero], -1)
    return gusts + peak
