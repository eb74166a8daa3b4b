"""Continuous turbulence: an intensity on a given Dryden realisation."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="turbulence",
    station="airflow",
    summary="Continuous random gusts of the Dryden spectra.",
    equation="gust' = gust + intensity * (a realisation of intensity 1 m/s, sim.dryden), its rotation times rotation",
    source="MIL-F-8785C (1980), sec. 3.7.1.2 (Dryden form)",
    parameters=fixed(
        SimulationParameter("intensity", "m/s", "rms of the vertical gusts", 0.8, lower=0.0, upper=15.0),
        SimulationParameter(
            "rotation", "1", "share of the gusts' rotation that the aircraft feels", 0.5, 1.0, 0.0, 2.0, switch=False
        ),
    ),
)


def apply(values: Values, gusts: Scalar, realisation: Scalar) -> Scalar:
    """Gusts (..., 6) plus turbulence: velocity of the air along body axes (m/s), its rotation (rad/s)."""
    turning = felt_rotation(values, realisation[..., 3:])
    return gusts + values["intensity"] * jnp.concatenate([realisation[..., :3], turning], axis=-1)


def felt_rotation(values: Values, rotation: Scalar) -> Scalar:
    """The part of the air's rotation (rad/s) that acts on the aircraft."""
    felt: Scalar = values["rotation"] * rotation
    return felt
