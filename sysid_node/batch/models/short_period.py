"""Nonlinear short-period motion in body axes; everything slower, and the lateral motion, enters as measured.

The model of SIDPAC's output-error example (Morelli; Klein & Morelli, 2006, example 6.3): CZ and Cm are linear about the
first sample's angle of attack and elevator deflection. Airspeed, attitude, lateral motion and the longitudinal force
are inputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.models.model import ModelParameter, Scalars, StateSpaceModel
from sysid_node.dynamics.airflow import velocity_of
from sysid_node.dynamics.atmosphere import GRAVITY

INPUTS = ("de", "V", "beta", "p", "r", "phi", "theta", "ax", "rho", "q_measured")
PARAMETERS = ("CZ_alpha", "CZ_de", "CZ_0", "Cm_alpha", "Cm_q", "Cm_de", "Cm_0", "bias_az")


def short_period(aircraft: Aircraft, start: Mapping[str, float], alpha0: float, de0: float) -> StateSpaceModel:
    """States alpha (rad), q (rad/s); outputs alpha, q, az (m/s^2, at the CG, which the records must be referred to).

    ``alpha0``, ``de0`` (rad): the point about which CZ and Cm are linear. The pitch-rate regressor of Cm is the
    measured rate (input ``q_measured``), as in the original: with the modelled rate, the whole trajectory would depend
    on Cm_q. Parameters missing from ``start`` begin at zero.
    """
    motion = _ShortPeriod(aircraft, alpha0, de0)
    return StateSpaceModel(
        name="short_period",
        states=("alpha", "q"),
        inputs=INPUTS,
        outputs=("alpha", "q", "az"),
        parameters=tuple(ModelParameter(name, start.get(name, 0.0)) for name in PARAMETERS),
        derivative=motion.derivative,
        output=motion.output,
        units={"alpha": "rad", "q": "rad/s", "az": "m/s^2"},
    )


@dataclass(frozen=True)
class _ShortPeriod:
    """Equations of motion and measurement, as pure functions of state, input and parameters."""

    aircraft: Aircraft
    alpha0: float
    de0: float

    def derivative(self, x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        """The derivatives of alpha and q."""
        s, inertia = dict(zip(INPUTS, u, strict=True)), self.aircraft.inertia
        alpha, q = x
        CZ, Cm = self._coefficients(x, s, theta)
        ub, vb, wb = velocity_of((s["V"], alpha, s["beta"]), jnp)
        udot = s["r"] * vb - q * wb - GRAVITY * jnp.sin(s["theta"]) + s["ax"]
        gravity = GRAVITY * jnp.cos(s["theta"]) * jnp.cos(s["phi"])
        wdot = q * ub - s["p"] * vb + gravity + self._normal_acceleration(s, CZ)
        moment = 0.5 * s["rho"] * s["V"] ** 2 * self.aircraft.geometry.S * self.aircraft.geometry.cbar * Cm
        coupling = (inertia.Izz - inertia.Ixx) * s["p"] * s["r"] + inertia.Ixz * (s["r"] ** 2 - s["p"] ** 2)
        return (wdot * ub - wb * udot) / (ub**2 + wb**2), (moment + coupling) / inertia.Iyy

    def output(self, x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        """alpha, q and az."""
        s = dict(zip(INPUTS, u, strict=True))
        return x[0], x[1], self._normal_acceleration(s, self._coefficients(x, s, theta)[0]) + theta[7]

    def _coefficients(self, x: Scalars, s: Mapping[str, jax.Array], theta: Scalars) -> tuple[jax.Array, jax.Array]:
        """CZ and Cm."""
        CZ_alpha, CZ_de, CZ_0, Cm_alpha, Cm_q, Cm_de, Cm_0, _ = theta
        alpha, de = x[0] - self.alpha0, s["de"] - self.de0
        rate = s["q_measured"] * self.aircraft.geometry.cbar / (2.0 * s["V"])
        return CZ_alpha * alpha + CZ_de * de + CZ_0, Cm_alpha * alpha + Cm_q * rate + Cm_de * de + Cm_0

    def _normal_acceleration(self, s: Mapping[str, jax.Array], CZ: jax.Array) -> jax.Array:
        """The specific force along the body's z axis, m/s^2."""
        return 0.5 * s["rho"] * s["V"] ** 2 * self.aircraft.geometry.S / self.aircraft.mass * CZ
