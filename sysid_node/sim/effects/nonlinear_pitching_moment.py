"""Pitching moment that is not linear in the angle of attack."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="nonlinear_pitching_moment",
    station="aerodynamics",
    summary="Static stability changes with the angle of attack.",
    equation="Cm' = Cm + quadratic (alpha - alpha0)^2 + cubic (alpha - alpha0)^3, alpha0 at the reference condition",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 3 (polynomial terms)",
    parameters=fixed(
        SimulationParameter("quadratic", "1/rad^2", "quadratic term", 1.0),
        SimulationParameter("cubic", "1/rad^3", "cubic term", 10.0),
    ),
)


def pitching_moment(values: Values, alpha: Scalar) -> Scalar:
    """Added Cm; ``alpha`` (rad) counts from the reference condition."""
    return alpha * alpha * (values["quadratic"] + values["cubic"] * alpha)
