"""Lift and pitching moment due to the rate of the angle of attack."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="unsteady_aerodynamics",
    station="aerodynamics",
    summary="The wing's downwash reaches the tail late: forces depend on dalpha/dt.",
    equation="CL' = CL + CL_alphadot a, Cm' = Cm + Cm_alphadot a, a = dalpha/dt cbar / 2V",
    source="Etkin & Reid (1996), Dynamics of Flight, sec. 5.5 (the alpha-dot derivatives)",
    parameters=fixed(
        SimulationParameter("CL_alphadot", "1/rad", "lift with the rate of alpha", 1.5, lower=-20.0, upper=20.0),
        SimulationParameter(
            "Cm_alphadot", "1/rad", "pitching moment with the rate of alpha", 3.0, lower=-60.0, upper=60.0
        ),
    ),
)


def lift(values: Values, rate: Scalar) -> Scalar:
    """Added CL; rate is dalpha/dt cbar / 2V."""
    return values["CL_alphadot"] * rate


def pitching_moment(values: Values, rate: Scalar) -> Scalar:
    """Added Cm; rate is dalpha/dt cbar / 2V."""
    return values["Cm_alphadot"] * rate


def solve_rate(values: Values, rate: Scalar, reduction: Scalar) -> Scalar:
    """dalpha/dt (rad/s) with this lift, from ``rate`` (rad/s), its value without the lift.

    The lift is normal to the flow and therefore reduces the rate by reduction * CL_alphadot * dalpha/dt, where
    reduction = qbar S cbar / (2 V m) / (speed in the x-z plane). The equation is linear and is solved in closed form.
    """
    return rate / (1.0 + reduction * values["CL_alphadot"])
