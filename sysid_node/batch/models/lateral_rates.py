"""Roll and yaw rate of an aircraft whose sideslip is measured: dimensional derivatives, linear.

Jategaonkar (2015), sec. 4.20.1, eqs. 4.90 and 4.91 (ATTAS). With beta an input the equations of p and r stand alone,
and neither airspeed, mass nor inertia need be known. The offsets lump initial conditions and biases of the measured
inputs.
"""

from __future__ import annotations

from collections.abc import Mapping

import jax
import jax.numpy as jnp

from sysid_node.batch.models.model import ModelParameter, Scalars, StateSpaceModel

_REGRESSORS = ("p", "r", "da", "dr", "beta")
_UNITS = {"L": "1/s", "N": "1/s", "Y": "m/s"}


def lateral_rates(start: Mapping[str, float]) -> StateSpaceModel:
    """States p, r (rad/s, from their first values); inputs da, dr, beta (rad); outputs pdot, rdot, ay, p, r.

    Parameters ``L_p ... N_beta, Y_p ... Y_beta`` per rad or rad/s, offsets ``L_0 N_0`` of the state equations and
    ``bias_<output>``; those missing from ``start`` begin at zero.
    """
    names = [f"{axis}_{regressor}" for axis in "LNY" for regressor in _REGRESSORS]
    names += ["L_0", "N_0", *(f"bias_{output}" for output in ("pdot", "rdot", "ay", "p", "r"))]
    parameters = tuple(ModelParameter(name, start.get(name, 0.0), unit=_UNITS.get(name[0], "")) for name in names)

    def acceleration(axis: int, x: Scalars, u: Scalars, theta: Scalars) -> jax.Array:
        slopes = theta[5 * axis : 5 * axis + 5]
        return jnp.asarray(sum(slope * value for slope, value in zip(slopes, (*x, *u), strict=True)))

    def derivative(x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        return tuple(acceleration(axis, x, u, theta) + theta[15 + axis] for axis in (0, 1))

    def output(x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        true = (*(acceleration(axis, x, u, theta) for axis in (0, 1, 2)), *x)
        return tuple(value + bias for value, bias in zip(true, theta[17:22], strict=True))

    return StateSpaceModel(
        name="lateral_rates",
        states=("p", "r"),
        inputs=("da", "dr", "beta"),
        outputs=("pdot", "rdot", "ay", "p", "r"),
        parameters=parameters,
        derivative=derivative,
        output=output,
        units={"p": "rad/s", "r": "rad/s", "pdot": "rad/s^2", "rdot": "rad/s^2", "ay": "m/s^2"},
    )
