"""Tail surfaces in the propeller's slipstream."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

#: Controls in the propeller's slipstream.
IN_SLIPSTREAM = ("elevator", "rudder")

EFFECT = Effect(
    name="propwash",
    station="propulsion",
    summary="Elevator and rudder do more the more the propeller pulls.",
    equation="delta' = delta (1 + gain T / (qbar S)), of elevator and rudder",
    source="Stinton (2001), The Design of the Aeroplane; actuator disc: q_slip = q (1 + T / (q A))",
    parameters=fixed(
        SimulationParameter(
            "gain", "1", "S over disc area, times the share of the tail in the slipstream", 1.0, 0.0, -5.0, 50.0
        )
    ),
)


def factor(values: Values, control: str, thrust: Scalar, pressure_area: Scalar) -> Scalar | float:
    """The factor of the control's effect; ``pressure_area`` is qbar S, N."""
    if control not in IN_SLIPSTREAM:
        return 1.0
    return 1.0 + values["gain"] * thrust / pressure_area
