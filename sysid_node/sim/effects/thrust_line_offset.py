"""A thrust line at another height than in the file."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="thrust_line_offset",
    station="propulsion",
    summary="The thrust line passes below (nose up) or above (nose down) where the file has it.",
    equation="M' = M + T arm",
    source="Etkin & Reid (1996), Dynamics of Flight, ch. 2 (influence of the propulsive system)",
    parameters=fixed(SimulationParameter("arm", "m", "thrust line below the nominal", 0.02, lower=-2.0, upper=2.0)),
)


def pitching_moment(values: Values, thrust: Scalar) -> Scalar:
    """Added pitching moment, N m."""
    return values["arm"] * thrust
