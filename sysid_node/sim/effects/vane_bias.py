"""Offsets of the flow angles."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="vane_bias",
    station="sensors",
    summary="The vanes read off by a constant.",
    equation="alpha' = alpha + bias, beta' = beta + bias",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 10 (instrument errors)",
    parameters=fixed(
        SimulationParameter("alpha", "rad", "offset of alpha", 0.01, lower=-0.5, upper=0.5),
        SimulationParameter("beta", "rad", "offset of beta", 0.01, lower=-0.5, upper=0.5),
    ),
)


def apply(values: Values, alpha: Scalar, beta: Scalar) -> tuple[Scalar, Scalar]:
    """The flow angles (rad) that are read."""
    return alpha + values["alpha"], beta + values["beta"]


def undo(values: Values, alpha: Scalar, beta: Scalar) -> tuple[Scalar, Scalar]:
    """The true flow angles (rad) of the readings."""
    return alpha - values["alpha"], beta - values["beta"]
