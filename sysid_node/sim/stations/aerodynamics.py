"""Station ``aerodynamics``: coefficients, and the forces and moments they make."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp

from sysid_node.sim.body import Vector
from sysid_node.sim.effects import (
    control_nonlinearity,
    drag_rise,
    ground_effect,
    lateral_alpha_coupling,
    lateral_asymmetry,
    nonlinear_pitching_moment,
    propwash,
    stall_separation,
    unsteady_aerodynamics,
)
from sysid_node.sim.model.layout import Layout, Model, Scalar, Values
from sysid_node.sim.stations.airflow import Air


class Coefficients(NamedTuple):
    """CL, CD in stability axes, CY and the moments in body axes about the file's CG."""

    CL: Scalar
    CD: Scalar
    CY: Scalar
    Cl: Scalar
    Cm: Scalar
    Cn: Scalar


def deflections(
    layout: Layout, model: Model, effects: dict[str, Values], surfaces: list[Scalar], air: Air, thrust: Scalar
) -> list[Scalar]:
    """What the linear derivatives see of each surface, rad."""
    bent = []
    for control, x in zip(layout.controls, surfaces, strict=True):
        washed = propwash.factor(effects["propwash"], control, thrust, air.pressure * model.area)
        bent.append(control_nonlinearity.apply(effects["control_nonlinearity"], control, x) * washed)
    return bent


def regressors(layout: Layout, model: Model, air: Air, deflections: list[Scalar]) -> dict[str, Scalar]:
    """Every regressor by name but CL^2; rates non-dimensional."""
    half = 0.5 / air.speed
    return {
        "0": jnp.ones_like(air.speed),
        "alpha": air.alpha,
        "beta": air.beta,
        "p": air.rates.x * model.span * half,
        "q": air.rates.y * model.chord * half,
        "r": air.rates.z * model.span * half,
        "V": air.speed / model.airspeed,
        **dict(zip(layout.symbols, deflections, strict=True)),
    }


def coefficients(
    layout: Layout, model: Model, effects: dict[str, Values], x: dict[str, Scalar], separation: Scalar, climb: Scalar
) -> Coefficients:
    """All six, without what comes with the rate of alpha.

    ``x`` regressors; ``separation`` the attached fraction of the flow; ``climb`` (m) since the start.
    """
    derivative = dict(zip(layout.derivatives, model.derivatives, strict=True))
    error = effects["derivative_error"]

    def linear(coefficient: str) -> Scalar:
        total = jnp.zeros_like(x["alpha"])
        for name, regressor in layout.terms(coefficient):
            total = total + (derivative[name] + error[name]) * x[regressor]
        return total

    alpha = x["alpha"] - model.alpha
    ground = ground_effect.share(effects["ground_effect"], climb, model.span)
    stall, coupling = effects["stall_separation"], effects["lateral_alpha_coupling"]
    attached = linear("CL")
    CL = attached * stall_separation.lift_factor(stall, separation)
    CL = CL + ground_effect.lift(effects["ground_effect"], ground, CL)
    x = {**x, "k": CL * CL}
    CY_0, Cl_0, Cn_0 = lateral_asymmetry.offsets(effects["lateral_asymmetry"])
    return Coefficients(
        CL=CL,
        CD=linear("CD")
        + stall_separation.drag(stall, separation)
        + drag_rise.drag(effects["drag_rise"], CL - model.lift)
        + ground_effect.drag(effects["ground_effect"], ground, CL),
        CY=linear("CY") + CY_0,
        Cl=linear("Cl") + Cl_0 + lateral_alpha_coupling.rolling_moment(coupling, alpha, x["beta"], x["r"]),
        Cm=linear("Cm")
        + nonlinear_pitching_moment.pitching_moment(effects["nonlinear_pitching_moment"], alpha)
        + stall_separation.pitching_moment(stall, separation)
        + ground_effect.pitching_moment(effects["ground_effect"], ground, CL),
        Cn=linear("Cn") + Cn_0 + lateral_alpha_coupling.yawing_moment(coupling, alpha, x["beta"]),
    )


def of_alpha_rate(model: Model, effects: dict[str, Values], air: Air, rate: Scalar) -> Coefficients:
    """What the rate of alpha (rad/s) adds."""
    values, reduced = effects["unsteady_aerodynamics"], rate * model.chord * 0.5 / air.speed
    zero = jnp.zeros_like(reduced)
    lift, pitching_moment = (
        unsteady_aerodynamics.lift(values, reduced),
        unsteady_aerodynamics.pitching_moment(values, reduced),
    )
    return Coefficients(lift, zero, zero, zero, pitching_moment, zero)


def load(model: Model, air: Air, c: Coefficients) -> tuple[Vector, Vector]:
    """Force (N) and moment about the file's CG (N m), body axes."""
    u, w = air.velocity.x, air.velocity.z
    forward = jnp.sqrt(u * u + w * w)
    cos, sin = u / forward, w / forward
    scale = air.pressure * model.area
    force = Vector(scale * (c.CL * sin - c.CD * cos), scale * c.CY, -scale * (c.CL * cos + c.CD * sin))
    moment = Vector(scale * model.span * c.Cl, scale * model.chord * c.Cm, scale * model.span * c.Cn)
    return force, moment
