"""The steady Kalman filter along a flight, as a differentiable function.

Maine & Iliff, "Formulation and Implementation of a Practical Algorithm for Parameter Estimation with Process and
Measurement Noise", SIAM J. Appl. Math. 41 (1981); Jategaonkar (2015), ch. 5. The state moves by the model's
Runge-Kutta step plus white process noise, the outputs carry white measurement noise, all channels independent.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp

from sysid_node.batch.likelihood.rollout import output, rk4_step
from sysid_node.batch.models.model import ModelEquations

#: Doubling steps of the Riccati equation, enough for time constants of up to 2^16 samples.
_DOUBLINGS = 16


def steady_covariance(transition: jax.Array, observation: jax.Array, Q: jax.Array, r: jax.Array) -> jax.Array:
    """The steady covariance (nx, nx) of the predicted state.

    Solves P = F (P - P C' (C P C' + R)^-1 C P) F' + Q by structure-preserving doubling (Anderson, Int. J. Control 28,
    1978), which is smooth in F ``transition`` (nx, nx), C ``observation`` (ny, nx), ``Q`` (nx, nx) and the variances
    ``r`` (ny,) on the diagonal of R.
    """
    identity = jnp.eye(transition.shape[0])

    def double(_: int, agh: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array, jax.Array]:
        a, g, h = agh
        inverse = jnp.linalg.inv(identity + g @ h)
        return a @ inverse @ a, g + a @ inverse @ g @ a.T, h + a.T @ h @ inverse @ a

    information = observation.T @ (observation / r[:, None])
    h: jax.Array = jax.lax.fori_loop(0, _DOUBLINGS, double, (transition.T, information, Q))[2]
    return 0.5 * (h + h.T)


def gain(covariance: jax.Array, observation: jax.Array, r: jax.Array) -> jax.Array:
    """The Kalman gain (nx, ny) = P C' (C P C' + R)^-1 for a predicted state's covariance P."""
    cross = covariance @ observation.T
    return jnp.asarray(jnp.linalg.solve(observation @ cross + jnp.diag(r), cross.T)).T


def predictions(
    dynamics: ModelEquations,
    time: jax.Array,
    inputs: jax.Array,
    outputs: jax.Array,
    x0: jax.Array,
    theta: jax.Array,
    q: jax.Array,
    r: jax.Array,
) -> jax.Array:
    """The outputs (N, ny), each predicted from all samples before it.

    ``q`` (nx,) is the variance that process noise adds to each state in a second, ``r`` (ny,) the outputs' noise
    variance. The gain is the steady one of the linearisation at the first sample.
    """
    dt = jnp.diff(time)
    covariance, observation = _linearised(dynamics, dt[0], inputs[0], x0, theta, q, r)
    k = gain(covariance, observation, r)

    def advance(x: jax.Array, interval: tuple[jax.Array, ...]) -> tuple[jax.Array, jax.Array]:
        u0, u1, y, width = interval
        predicted = output(dynamics, x, u0, theta)
        return rk4_step(dynamics, x + k @ (y - predicted), u0, u1, width, theta), predicted

    x, predicted = jax.lax.scan(advance, x0, (inputs[:-1], inputs[1:], outputs[:-1], dt))
    return jnp.concatenate([predicted, output(dynamics, x, inputs[-1], theta)[None, :]])


@partial(jax.jit, static_argnums=0)
def innovation_variance(
    dynamics: ModelEquations, dt: jax.Array, u: jax.Array, x: jax.Array, theta: jax.Array, q: jax.Array, r: jax.Array
) -> jax.Array:
    """The variance (ny,) of the innovations that the filter expects at one flight condition."""
    covariance, observation = _linearised(dynamics, dt, u, x, theta, q, r)
    return jnp.einsum("os,st,ot->o", observation, covariance, observation) + r


def _linearised(
    dynamics: ModelEquations, dt: jax.Array, u: jax.Array, x: jax.Array, theta: jax.Array, q: jax.Array, r: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """The steady covariance of the predicted state and the observation matrix, linearised at one flight condition.

    The noise is continuous: its effect on the state at the end of a step is integrated by Simpson's rule.
    """
    move = jax.jacfwd(partial(rk4_step, dynamics))
    half, whole = move(x, u, u, 0.5 * dt, theta), move(x, u, u, dt, theta)
    observation = jax.jacfwd(partial(output, dynamics))(x, u, theta)
    Q = dt / 6.0 * (jnp.diag(q) + 4.0 * (half * q) @ half.T + (whole * q) @ whole.T)
    return steady_covariance(whole, observation, Q, r), observation
