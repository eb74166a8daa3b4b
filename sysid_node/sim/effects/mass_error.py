"""A mass that differs from the file's."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="mass_error",
    station="mass",
    summary="The mass differs from the file's; the inertia does not.",
    equation="m' = m (1 + error)",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 3 (equations of motion)",
    parameters=fixed(SimulationParameter("error", "1", "share of the mass", 0.05, lower=-0.8, upper=3.0)),
)


def apply(values: Values, mass: Scalar) -> Scalar:
    """Mass, kg."""
    return mass * (1.0 + values["error"])
