"""A centre of gravity at another place than in the file."""

from __future__ import annotations

from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Values

EFFECT = Effect(
    name="cg_shift",
    station="mass",
    summary="Aerodynamic and thrust forces act about another point; sensors sit elsewhere from it.",
    equation="moment' = moment - shift x force; arm' = arm - shift of every sensor",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 3 (transfer of moments to another point)",
    parameters=fixed(
        SimulationParameter("x", "m", "CG forward of the file's", 0.02, lower=-2.0, upper=2.0),
        SimulationParameter("y", "m", "CG to the right of the file's", 0.005, lower=-2.0, upper=2.0),
        SimulationParameter("z", "m", "CG below the file's", 0.01, lower=-2.0, upper=2.0),
    ),
)


def shift(values: Values) -> Vector:
    """Position of the CG relative to the file's, m."""
    return Vector(values["x"], values["y"], values["z"])
