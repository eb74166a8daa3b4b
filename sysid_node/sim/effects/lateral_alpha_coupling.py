"""Lateral derivatives that change with the angle of attack."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="lateral_alpha_coupling",
    station="aerodynamics",
    summary="Dihedral effect, weathercock stability and roll due to yaw rate change with the angle of attack.",
    equation="Cl' = Cl + (Cl_beta_alpha beta + Cl_r_alpha r) a, Cn' = Cn + Cn_beta_alpha beta a, a = alpha - alpha0",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 3 (polynomial terms)",
    parameters=fixed(
        SimulationParameter("Cl_beta_alpha", "1/rad^2", "slope of Cl_beta with alpha", 0.4),
        SimulationParameter("Cn_beta_alpha", "1/rad^2", "slope of Cn_beta with alpha", 0.2),
        SimulationParameter("Cl_r_alpha", "1/rad^2", "slope of Cl_r with alpha", 1.0),
    ),
)


def rolling_moment(values: Values, alpha: Scalar, beta: Scalar, r: Scalar) -> Scalar:
    """Added Cl; ``alpha`` (rad) counts from the reference condition, ``r`` is the non-dimensional yaw rate."""
    return (values["Cl_beta_alpha"] * beta + values["Cl_r_alpha"] * r) * alpha


def yawing_moment(values: Values, alpha: Scalar, beta: Scalar) -> Scalar:
    """Added Cn; ``alpha`` (rad) counts from the reference condition."""
    return values["Cn_beta_alpha"] * beta * alpha
