"""Free play between actuator and surface."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, each_control, of_control
from sysid_node.sim.model.layout import Scalar, Values
from sysid_node.sim.signals.smooth import soft_dead_zone

EFFECT = Effect(
    name="actuator_backlash",
    station="actuator",
    summary="Surfaces stay where they are until the actuator has taken up the free play.",
    equation="x' = x + D(u - x), D the dead zone of +-width/2, its corners rounded: d - w d / (1 + (d / w)^64)^(1/64)",
    source="Nordin & Gutman (2002), Automatica 38(10) (backlash as hysteresis driven by friction)",
    parameters=each_control(SimulationParameter("width", "rad", "width of the free play", 0.02, lower=0.0, upper=0.5)),
    shared="width",
)


def advance(values: Values, control: str, x: Scalar, u: Scalar) -> Scalar:
    """The surface's new position (rad), from its position x as the actuator moves to u (rad)."""
    return x + soft_dead_zone(u - x, 0.5 * of_control(values, "width", control))
