"""A limit to the rate of the actuators."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, each_control
from sysid_node.sim.model.layout import Scalar
from sysid_node.sim.signals.smooth import soft_clip

EFFECT = Effect(
    name="actuator_rate_limit",
    station="actuator",
    summary="Surfaces move no faster than a rate.",
    equation="x' = x + clip(u - x, -+ rate step), the clip's corner rounded: d / (1 + (d / limit)^16)^(1/16)",
    source="Klyde, McRuer & Myers (1997), J. Guidance 20(1) (rate-limited actuators)",
    parameters=each_control(
        SimulationParameter("inverse_rate", "s/rad", "1 / largest rate", 0.5, lower=0.0, upper=50.0, reciprocal="rate")
    ),
    shared="inverse_rate",
)


def advance(inverse_rate: Scalar, x: Scalar, u: Scalar, step: Scalar) -> Scalar:
    """The position (rad) one step (s) later, from x towards u (rad); ``inverse_rate`` is in s/rad."""
    return x + soft_clip(u - x, inverse_rate / step)
