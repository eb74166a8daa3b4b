"""Scale error of the thrust."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="thrust_scale",
    station="propulsion",
    summary="Thrust differs from the commanded by a factor.",
    equation="T' = T (1 + error)",
    source="Jategaonkar (2015), Flight Vehicle System Identification (thrust as a source of model error)",
    parameters=fixed(SimulationParameter("error", "1", "share of the thrust", 0.15, lower=-1.0, upper=3.0)),
)


def apply(values: Values, thrust: Scalar) -> Scalar:
    """Thrust (N) with its scale error."""
    return thrust * (1.0 + values["error"])
