"""Short-period motion with everything slower or sideways as measured: nonlinear, body axes, two states.

The model of SIDPAC's output-error example (Morelli; Klein & Morelli, 2006, example 6.3): CZ and Cm linear about the
first sample's angle of attack and elevator; airspeed, attitude, lateral motion and the longitudinal force enter as
measured.
"""

from __future__ import annotations

from collections.abc import Mapping

import jax
import jax.numpy as jnp

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.models.kinematics import GRAVITY
from sysid_node.batch.models.model import Parameter, Scalars, StateSpaceModel

INPUTS = ("de", "V", "beta", "p", "r", "phi", "theta", "ax", "rho", "q_measured")
PARAMETERS = ("CZ_alpha", "CZ_de", "CZ_0", "Cm_alpha", "Cm_q", "Cm_de", "Cm_0", "bias_az")


def short_period(aircraft: Aircraft, start: Mapping[str, float], alpha0: float, de0: float) -> StateSpaceModel:
    """States alpha (rad), q (rad/s); outputs alpha, q, az (m/s^2, at the CG, which the records must be referred to).

    ``alpha0``, ``de0`` (rad): the point about which CZ and Cm are linear. The pitch-rate regressor of Cm is the
    measured rate (input ``q_measured``), as in the original: a pitch rate that the model itself makes up would put the
    weight of the whole trajectory on Cm_q. Parameters missing from ``start`` begin at zero.
    """
    geometry, inertia = aircraft.geometry, aircraft.inertia

    def coefficients(x: Scalars, s: Mapping[str, jax.Array], theta: Scalars) -> tuple[jax.Array, jax.Array]:
        CZ_alpha, CZ_de, CZ_0, Cm_alpha, Cm_q, Cm_de, Cm_0, _ = theta
        alpha, de = x[0] - alpha0, s["de"] - de0
        rate = s["q_measured"] * geometry.cbar / (2.0 * s["V"])
        return CZ_alpha * alpha + CZ_de * de + CZ_0, Cm_alpha * alpha + Cm_q * rate + Cm_de * de + Cm_0

    def normal_acceleration(s: Mapping[str, jax.Array], CZ: jax.Array) -> jax.Array:
        return 0.5 * s["rho"] * s["V"] ** 2 * geometry.S / aircraft.mass * CZ

    def derivative(x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        s = dict(zip(INPUTS, u, strict=True))
        alpha, q = x
        CZ, Cm = coefficients(x, s, theta)
        cb = jnp.cos(s["beta"])
        ub, vb, wb = s["V"] * jnp.cos(alpha) * cb, s["V"] * jnp.sin(s["beta"]), s["V"] * jnp.sin(alpha) * cb
        udot = s["r"] * vb - q * wb - GRAVITY * jnp.sin(s["theta"]) + s["ax"]
        wdot = q * ub - s["p"] * vb + GRAVITY * jnp.cos(s["theta"]) * jnp.cos(s["phi"]) + normal_acceleration(s, CZ)
        moment = 0.5 * s["rho"] * s["V"] ** 2 * geometry.S * geometry.cbar * Cm
        coupling = (inertia.Izz - inertia.Ixx) * s["p"] * s["r"] + inertia.Ixz * (s["r"] ** 2 - s["p"] ** 2)
        return (wdot * ub - wb * udot) / (ub**2 + wb**2), (moment + coupling) / inertia.Iyy

    def output(x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        s = dict(zip(INPUTS, u, strict=True))
        return x[0], x[1], normal_acceleration(s, coefficients(x, s, theta)[0]) + theta[7]

    return StateSpaceModel(
        name="short_period",
        states=("alpha", "q"),
        inputs=INPUTS,
        outputs=("alpha", "q", "az"),
        parameters=tuple(Parameter(name, start.get(name, 0.0)) for name in PARAMETERS),
        derivative=derivative,
        output=output,
        units={"alpha": "rad", "q": "rad/s", "az": "m/s^2"},
    )
