"""Rigid-body kinematics over a flat earth in steadily moving air, and the sensor-error model built on them.

Klein & Morelli (2006), eqs. 3.35 and 3.33 for the equations, ch. 10 for data compatibility.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import jax
import jax.numpy as jnp

from sysid_node.aircraft.model import Vector3
from sysid_node.batch.models.model import ModelEquations, ModelParameter, Scalars, StateSpaceModel
from sysid_node.dynamics.airflow import flow_angles, velocity_of, wind_axes_rates
from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.dynamics.attitude import down_of_euler, euler_rates
from sysid_node.dynamics.lever_arm import velocity_at
from sysid_node.dynamics.vector import Vector

Signals = Mapping[str, jax.Array]

STATES = ("V", "alpha", "beta", "phi", "theta", "psi")
INPUTS = ("ax_cg", "ay_cg", "az_cg", "p", "q", "r")

_IMU = ("ax", "ay", "az", "p", "q", "r")

#: Sensor errors with how large they may well be (1 sigma): biases of the IMU in m/s^2 and rad/s, biases (m/s, rad) and
#: scale errors of the air data.
SENSOR_ERRORS = {
    **{"bias_ax": 0.3, "bias_ay": 0.3, "bias_az": 0.3, "bias_p": 0.02, "bias_q": 0.02, "bias_r": 0.02},
    **{"bias_alpha": 0.03, "scale_alpha": 0.1, "bias_beta": 0.03, "scale_beta": 0.1, "scale_V": 0.05},
}


def flow_rates(s: Signals, force: tuple[jax.Array, jax.Array, jax.Array]) -> dict[str, jax.Array]:
    """Derivatives of V, alpha, beta from signals V alpha beta p q r phi theta and the specific force (body axes)."""
    acceleration = Vector(*force).plus(down_of_euler(s["phi"], s["theta"], jnp).times(GRAVITY))
    flow, rates = (s["V"], s["alpha"], s["beta"]), (s["p"], s["q"], s["r"])
    return dict(zip(("V", "alpha", "beta"), wind_axes_rates(flow, rates, acceleration, jnp), strict=True))


def attitude_rates(s: Signals) -> dict[str, jax.Array]:
    """Derivatives of the Euler angles phi, theta, psi at signals p q r phi theta."""
    rates = euler_rates(s["phi"], s["theta"], Vector(s["p"], s["q"], s["r"]), jnp)
    return dict(zip(("phi", "theta", "psi"), rates, strict=True))


def at_probe(position: Vector3, s: Signals) -> dict[str, jax.Array]:
    """V, alpha, beta where the probe sits, m from the CG: the rotation moves it through the air."""
    if not any(position):
        return {}
    velocity = velocity_of((s["V"], s["alpha"], s["beta"]), jnp)
    flow = flow_angles(velocity_at(velocity, (s["p"], s["q"], s["r"]), position), jnp)
    return dict(zip(("V", "alpha", "beta"), flow, strict=True))


def sensor_errors(outputs: Sequence[str], probe: Vector3 = (0.0, 0.0, 0.0)) -> StateSpaceModel:
    """Kinematics driven by the IMU with unknown sensor errors; ``outputs`` of V, alpha, beta, phi, theta, psi.

    ``probe`` is where the air data are measured, m from the CG.
    A reading is (1 + scale) * true + bias. Each error has zero as prior with its plausible size (``SENSOR_ERRORS``):
    what the flight does not show stays near zero.
    """
    names = tuple(name for name in SENSOR_ERRORS if name.rpartition("_")[2] in (*_IMU, *outputs))
    parameters = tuple(
        ModelParameter(
            name, 0.0, lower=-0.5 if name.startswith("scale") else float("-inf"), prior=(0.0, SENSOR_ERRORS[name])
        )
        for name in names
    )

    equations = _equations(names, tuple(outputs), tuple(probe))
    return StateSpaceModel(
        "sensor_errors", STATES, INPUTS, tuple(outputs), parameters, equations.derivative, equations.output
    )


@lru_cache(maxsize=16)
def _equations(names: tuple[str, ...], outputs: tuple[str, ...], probe: Vector3) -> ModelEquations:
    """The equations of the errors of these names, the same ones for all models, so that they are compiled once."""

    def signals(x: Scalars, u: Scalars, error: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
        s = dict(zip(STATES, x, strict=True)) | dict(zip(INPUTS, u, strict=True))
        return s | {rate: s[rate] - error[f"bias_{rate}"] for rate in "pqr"}

    def derivative(x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        error = dict(zip(names, theta, strict=True))
        s = signals(x, u, error)
        force = (s["ax_cg"] - error["bias_ax"], s["ay_cg"] - error["bias_ay"], s["az_cg"] - error["bias_az"])
        rates = {**flow_rates(s, force), **attitude_rates(s)}
        return tuple(rates[name] for name in STATES)

    def output(x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        error = dict(zip(names, theta, strict=True))
        s = signals(x, u, error)
        s |= at_probe(probe, s)
        return tuple(
            (1.0 + error.get(f"scale_{name}", 0.0)) * s[name] + error.get(f"bias_{name}", 0.0) for name in outputs
        )

    return ModelEquations(derivative, output)
