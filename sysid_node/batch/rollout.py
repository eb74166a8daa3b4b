"""Integration of a model over a manoeuvre, with the exact Jacobian of its outputs.

Classical Runge-Kutta of fourth order with a step per sample, the input linear between samples (its midpoint value is
their mean), as in Jategaonkar, "Flight Vehicle System Identification" (2nd ed., 2015), ch. 3.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.batch.model import Manoeuvre, Model
from sysid_node.flight.record import Array


def rk4_step(model: Model, x: jax.Array, u0: jax.Array, u1: jax.Array, dt: jax.Array, theta: jax.Array) -> jax.Array:
    """State (nx,) after ``dt`` s, the input going linearly from ``u0`` to ``u1``."""
    f = model.derivative
    middle = 0.5 * (u0 + u1)
    k1 = f(x, u0, theta)
    k2 = f(x + 0.5 * dt * k1, middle, theta)
    k3 = f(x + 0.5 * dt * k2, middle, theta)
    k4 = f(x + dt * k3, u1, theta)
    return x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def simulate(model: Model, time: jax.Array, inputs: jax.Array, x0: jax.Array, theta: jax.Array) -> jax.Array:
    """States (N, nx) at each time from ``x0`` (nx,); pure, differentiable."""

    def advance(x: jax.Array, interval: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        u0, u1, dt = interval
        following = rk4_step(model, x, u0, u1, dt, theta)
        return following, following

    _, states = jax.lax.scan(advance, x0, (inputs[:-1], inputs[1:], jnp.diff(time)))
    return jnp.concatenate([x0[None, :], states])


def _outputs(model: Model, time: jax.Array, inputs: jax.Array, x0: jax.Array, theta: jax.Array) -> jax.Array:
    states = simulate(model, time, inputs, x0, theta)
    return jax.vmap(model.output, in_axes=(0, 0, None))(states, inputs, theta)


_outputs_jit = jax.jit(_outputs, static_argnums=0)


@partial(jax.jit, static_argnums=(0, 5, 6))
def _sensitivities(
    model: Model,
    time: jax.Array,
    inputs: jax.Array,
    x0: jax.Array,
    theta: jax.Array,
    free: tuple[int, ...],
    free_states: tuple[int, ...],
) -> jax.Array:
    """d outputs / d (theta[free], x0[free_states]): (N, ny, len(free) + len(free_states))."""

    def of(change: jax.Array) -> jax.Array:
        moved_theta = theta.at[jnp.array(free, dtype=int)].add(change[: len(free)])
        moved_x0 = x0.at[jnp.array(free_states, dtype=int)].add(change[len(free) :])
        return _outputs(model, time, inputs, moved_x0, moved_theta)

    jacobian: jax.Array = jax.jacfwd(of)(jnp.zeros(len(free) + len(free_states)))
    return jacobian


def outputs(model: Model, manoeuvre: Manoeuvre, theta: Array, x0: Array | None = None) -> Array:
    """Modelled outputs (N, ny), from the manoeuvre's initial state unless ``x0`` (nx,) says otherwise."""
    start = manoeuvre.initial_state if x0 is None else x0
    return np.asarray(_outputs_jit(model, manoeuvre.time, manoeuvre.inputs, start, theta))


def sensitivities(
    model: Model,
    manoeuvre: Manoeuvre,
    theta: Array,
    x0: Array,
    free: tuple[int, ...],
    free_states: tuple[int, ...] = (),
) -> Array:
    """Exact Jacobian (N, ny, n) of the outputs with respect to the chosen parameters and initial states."""
    return np.asarray(
        _sensitivities(model, manoeuvre.time, manoeuvre.inputs, jnp.asarray(x0), jnp.asarray(theta), free, free_states)
    )
