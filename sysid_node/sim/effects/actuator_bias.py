"""A constant offset of a surface."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, per_control
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="actuator_bias",
    station="actuator",
    summary="Surfaces stand off what was commanded by a constant.",
    equation="x' = x + bias",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 10 (instrument and control biases)",
    parameters=per_control("rad", "offset", 0.01, lower=-0.5, upper=0.5),
)


def apply(values: Values, control: str, x: Scalar) -> Scalar:
    """The surface's position (rad) with its offset."""
    return x + values[control]
