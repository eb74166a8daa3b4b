"""Station ``aerodynamics``: coefficients, and forces and moments from them."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.dynamics.airflow import stability_axes
from sysid_node.dynamics.atmosphere import speed_of_sound
from sysid_node.dynamics.coefficients import Coefficients, linear_coefficient, regressors, with_polar
from sysid_node.dynamics.forces import force_and_moment
from sysid_node.dynamics.vector import Vector
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
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar, Values
from sysid_node.sim.stations.airflow import Air
from sysid_node.sim.stations.table_increments import table_increments


def deflections(
    layout: ParameterLayout,
    model: AircraftNumbers,
    effects: dict[str, Values],
    surfaces: list[Scalar],
    air: Air,
    thrust: Scalar,
) -> list[Scalar]:
    """Deflection of each surface by which its derivatives are multiplied, rad."""
    bent = []
    for control, x in zip(layout.controls, surfaces, strict=True):
        washed = propwash.factor(effects["propwash"], control, thrust, air.pressure * model.area)
        bent.append(control_nonlinearity.apply(effects["control_nonlinearity"], control, x) * washed)
    return bent


def regressors_of(
    layout: ParameterLayout, model: AircraftNumbers, air: Air, deflections: list[Scalar], throttle: Scalar
) -> dict[str, Scalar]:
    """Every regressor by name except CL^2; rates are non-dimensional."""
    flow, one = (air.speed, air.alpha, air.beta), jnp.ones_like(air.speed)
    state = regressors(flow, air.rates, model.span, model.chord, model.airspeed, one)
    if any("throttle" in over for _, over in layout.tables):
        state["throttle"] = throttle
    if any("Mach" in over for _, over in layout.tables):
        state["Mach"] = air.speed / speed_of_sound(air.density, jnp)
    return state | dict(zip(layout.symbols, deflections, strict=True))


def coefficients(
    layout: ParameterLayout,
    model: AircraftNumbers,
    effects: dict[str, Values],
    x: dict[str, Scalar],
    separation: Scalar,
    climb: Scalar,
) -> Coefficients:
    """All six coefficients without the terms in the rate of alpha.

    ``x`` are the regressors, ``separation`` is the attached fraction of the flow, ``climb`` (m) counts from the start.
    """
    derivative = dict(zip(layout.derivatives, model.derivatives, strict=True))
    error = effects["derivative_error"]

    added = table_increments(layout, model, x)

    def linear(coefficient: str) -> Scalar:
        terms = ((derivative[name] + error[name], regressor) for name, regressor in layout.terms(coefficient))
        total: Scalar = linear_coefficient(terms, x, jnp.zeros_like(x["alpha"]))
        return total + added[coefficient] if coefficient in added else total

    alpha = x["alpha"] - model.alpha
    ground = ground_effect.share(effects["ground_effect"], climb, model.span)
    stall, coupling = effects["stall_separation"], effects["lateral_alpha_coupling"]
    attached = linear("CL")
    CL = attached * stall_separation.lift_factor(stall, separation)
    CL = CL + ground_effect.lift(effects["ground_effect"], ground, CL)
    x = with_polar(x, CL)
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


def of_alpha_rate(model: AircraftNumbers, effects: dict[str, Values], air: Air, rate: Scalar) -> Coefficients:
    """The terms in the rate of alpha (rad/s)."""
    values, reduced = effects["unsteady_aerodynamics"], rate * model.chord * 0.5 / air.speed
    zero = jnp.zeros_like(reduced)
    lift, pitching_moment = (
        unsteady_aerodynamics.lift(values, reduced),
        unsteady_aerodynamics.pitching_moment(values, reduced),
    )
    return Coefficients(lift, zero, zero, zero, pitching_moment, zero)


def load(model: AircraftNumbers, air: Air, c: Coefficients) -> tuple[Vector, Vector]:
    """Force (N) and moment about the file's CG (N m), body axes."""
    return force_and_moment(c, stability_axes(air.velocity, jnp), air.pressure * model.area, model.span, model.chord)
