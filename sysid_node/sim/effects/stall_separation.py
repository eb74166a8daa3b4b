"""Flow separation at the wing's trailing edge, with hysteresis."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="stall_separation",
    station="aerodynamics",
    summary="Near stall the flow separates: lift is lost, drag and pitching moment are added, with a memory.",
    equation=(
        "tau1 cbar/V dX/dt + X = (1 - tanh(a1 (alpha - tau2 cbar/V dalpha/dt - alpha_star))) / 2; "
        "CL' = CL (1 - depth (1 - ((1 + sqrt X) / 2)^2)), CD' = CD + depth CD_X (1 - X), Cm' = Cm + depth Cm_X (1 - X)"
    ),
    source="Fischenberg & Jategaonkar (1999), RTO-MP-11; Jategaonkar (2015), ch. 12 (Kirchhoff's theory of stall)",
    parameters=fixed(
        SimulationParameter("depth", "1", "how much of it: 0 none, 1 as the theory has it", 1.0, lower=0.0, upper=1.5),
        SimulationParameter(
            "alpha_star", "rad", "angle at which half the flow is separated", 0.04, 0.26, 0.05, 1.0, False
        ),
        SimulationParameter("a1", "1", "how abruptly", 5.0, 20.0, 1.0, 60.0, False),
        SimulationParameter("tau1", "cbar/V", "relaxation time", 5.0, 10.0, 0.5, 100.0, False),
        SimulationParameter("tau2", "cbar/V", "delay with the rate of alpha", 2.0, 3.0, 0.0, 30.0, False),
        SimulationParameter("CD_X", "1", "drag of full separation", 0.05, 0.1, -1.0, 2.0, False),
        SimulationParameter("Cm_X", "1", "pitching moment of full separation", 0.03, -0.05, -1.0, 1.0, False),
    ),
)


def attached(values: Values, alpha: Scalar, alpha_rate: Scalar, time_scale: Scalar) -> Scalar:
    """Steady attached fraction X0 of the flow, 0 to 1, at alpha (rad), its rate (rad/s) and cbar / V (s)."""
    lagged = alpha - values["tau2"] * time_scale * alpha_rate
    return 0.5 * (1.0 - jnp.tanh(values["a1"] * (lagged - values["alpha_star"])))


def rate(values: Values, x: Scalar, steady: Scalar, time_scale: Scalar) -> Scalar:
    """dX/dt, 1/s."""
    return (steady - x) / (values["tau1"] * time_scale)


def lift_factor(values: Values, x: Scalar) -> Scalar:
    """Lift as a fraction of the attached flow's; the square root is rounded below X = 1e-4."""
    half = 0.5 * (1.0 + jnp.sqrt(jnp.maximum(x, 0.0) + 1e-8) / jnp.sqrt(1.0 + 1e-8))
    return 1.0 - values["depth"] * (1.0 - half * half)


def drag(values: Values, x: Scalar) -> Scalar:
    """Added CD."""
    return values["depth"] * values["CD_X"] * (1.0 - x)


def pitching_moment(values: Values, x: Scalar) -> Scalar:
    """Added Cm."""
    return values["depth"] * values["Cm_X"] * (1.0 - x)
