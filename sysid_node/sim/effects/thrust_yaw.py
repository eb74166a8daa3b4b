"""Yawing and rolling moments of the thrust."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="thrust_yaw",
    station="propulsion",
    summary="Asymmetric thrust, the propeller's P-factor and its torque.",
    equation="N' = N + T (arm + p_factor alpha), L' = L + T torque_arm",
    source="McCormick (1995), Aerodynamics, Aeronautics and Flight Mechanics (propeller in inclined flow)",
    parameters=fixed(
        SimulationParameter("arm", "m", "thrust line to the left of the CG", 0.01, lower=-2.0, upper=2.0),
        SimulationParameter("p_factor", "m/rad", "arm gained with the angle of attack", 0.1, lower=-5.0, upper=5.0),
        SimulationParameter("torque_arm", "m", "rolling moment for each newton", 0.01, lower=-1.0, upper=1.0),
    ),
)


def yawing_moment(values: Values, thrust: Scalar, alpha: Scalar) -> Scalar:
    """Added yawing moment, N m."""
    return thrust * (values["arm"] + values["p_factor"] * alpha)


def rolling_moment(values: Values, thrust: Scalar) -> Scalar:
    """Added rolling moment, N m."""
    return thrust * values["torque_arm"]
