"""An airframe that is not symmetric."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="lateral_asymmetry",
    station="aerodynamics",
    summary="A warped wing or a canted fin: side force, roll and yaw without sideslip.",
    equation="CY' = CY + CY_0, Cl' = Cl + Cl_0, Cn' = Cn + Cn_0",
    source="Etkin & Reid (1996), Dynamics of Flight, ch. 3 (lateral control and trim)",
    parameters=fixed(
        SimulationParameter("CY_0", "1", "side force", 0.005, lower=-0.5, upper=0.5),
        SimulationParameter("Cl_0", "1", "rolling moment", 0.002, lower=-0.2, upper=0.2),
        SimulationParameter("Cn_0", "1", "yawing moment", 0.002, lower=-0.2, upper=0.2),
    ),
)


def offsets(values: Values) -> tuple[Scalar, Scalar, Scalar]:
    """Added CY, Cl, Cn."""
    return values["CY_0"], values["Cl_0"], values["Cn_0"]
