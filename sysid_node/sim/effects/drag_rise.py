"""Drag that grows faster than the aircraft file's polar."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="drag_rise",
    station="aerodynamics",
    summary="A parabola of lift on top of the drag polar.",
    equation="CD' = CD + parabola (CL - CL0)^2, CL0 at the reference condition",
    source="Raymer (2018), Aircraft Design: A Conceptual Approach, ch. 12 (drag due to lift)",
    parameters=fixed(SimulationParameter("parabola", "1", "quadratic term in CL", 0.05, lower=-2.0, upper=5.0)),
)


def drag(values: Values, lift: Scalar) -> Scalar:
    """Added CD; ``lift`` is CL minus that of the reference condition."""
    return values["parabola"] * lift * lift
