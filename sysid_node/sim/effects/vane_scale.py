"""Scale errors of the flow angles."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="vane_scale",
    station="sensors",
    summary="The vanes read too much or too little (upwash ahead of wing and fuselage).",
    equation="alpha' = alpha (1 + error), beta' = beta (1 + error)",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 10 (upwash at the vanes)",
    parameters=fixed(
        SimulationParameter("alpha", "1", "scale error of alpha", 0.1, lower=-0.9, upper=2.0),
        SimulationParameter("beta", "1", "scale error of beta", 0.1, lower=-0.9, upper=2.0),
    ),
)


def apply(values: Values, alpha: Scalar, beta: Scalar) -> tuple[Scalar, Scalar]:
    """The flow angles (rad) that are read."""
    return alpha * (1.0 + values["alpha"]), beta * (1.0 + values["beta"])


def undo(values: Values, alpha: Scalar, beta: Scalar) -> tuple[Scalar, Scalar]:
    """The true flow angles (rad) of the readings."""
    return alpha / (1.0 + values["alpha"]), beta / (1.0 + values["beta"])
