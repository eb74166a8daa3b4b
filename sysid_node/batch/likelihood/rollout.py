"""Integration of a model over a manoeuvre, with the exact Jacobian of its outputs.

Classical Runge-Kutta of fourth order with a step per sample, the input linear between samples (its midpoint value is
their mean), as in Jategaonkar, "Flight Vehicle System Identification" (2nd ed., 2015), ch. 3.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.batch.models.manoeuvre import ManoeuvreData
from sysid_node.batch.models.model import ModelEquations, StateSpaceModel
from sysid_node.flight.record import Array

#: Runge-Kutta coefficients of fourth order: the time of each stage in the step, and its weight in the result.
_NODES, _WEIGHTS = (0.0, 0.5, 0.5, 1.0), (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)


def rk4_step(
    dynamics: ModelEquations, x: jax.Array, u0: jax.Array, u1: jax.Array, dt: jax.Array, theta: jax.Array
) -> jax.Array:
    """The state (nx,) after ``dt`` s, with the input (nu,) linear from ``u0`` to ``u1``.

    The stages are a loop: written out one after the other, XLA fuses them into code whose size grows exponentially.
    """

    def stage(
        carry: tuple[jax.Array, jax.Array], at: tuple[jax.Array, jax.Array]
    ) -> tuple[tuple[jax.Array, jax.Array], None]:
        slope, total = carry
        node, weight = at
        slope = derivative(dynamics, x + node * dt * slope, u0 + node * (u1 - u0), theta)
        return (slope, total + weight * slope), None

    nothing = jnp.zeros_like(x)
    (_, total), _ = jax.lax.scan(stage, (nothing, nothing), (jnp.array(_NODES), jnp.array(_WEIGHTS)))
    return x + dt * total


def derivative(dynamics: ModelEquations, x: jax.Array, u: jax.Array, theta: jax.Array) -> jax.Array:
    """The state derivative (nx,)."""
    return jnp.stack(dynamics.derivative(tuple(x), tuple(u), tuple(theta)))


def output(dynamics: ModelEquations, x: jax.Array, u: jax.Array, theta: jax.Array) -> jax.Array:
    """The outputs (..., ny) at states (..., nx) and inputs (..., nu)."""
    values = dynamics.output(tuple(jnp.moveaxis(x, -1, 0)), tuple(jnp.moveaxis(u, -1, 0)), tuple(theta))
    return jnp.stack(jnp.broadcast_arrays(*values), axis=-1)


def simulate(
    dynamics: ModelEquations, time: jax.Array, inputs: jax.Array, x0: jax.Array, theta: jax.Array
) -> jax.Array:
    """The states (N, nx) at each time from ``x0`` (nx,); a differentiable function without side effects."""

    def advance(x: jax.Array, interval: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        following = rk4_step(dynamics, x, *interval, theta)
        return following, following

    _, states = jax.lax.scan(advance, x0, (inputs[:-1], inputs[1:], jnp.diff(time)))
    return jnp.concatenate([x0[None, :], states])


def _outputs(
    dynamics: ModelEquations, every: int, time: jax.Array, inputs: jax.Array, x0: jax.Array, theta: jax.Array
) -> jax.Array:
    values = output(dynamics, simulate(dynamics, time, inputs, x0, theta), inputs, theta)
    rows = len(time) // every
    return values[: rows * every].reshape(rows, every, -1).mean(axis=1) if every > 1 else values


_outputs_jit = jax.jit(_outputs, static_argnums=(0, 1))


@partial(jax.jit, static_argnums=(0, 1, 6, 7))
def _sensitivities(
    dynamics: ModelEquations,
    every: int,
    time: jax.Array,
    inputs: jax.Array,
    x0: jax.Array,
    theta: jax.Array,
    free: tuple[int, ...],
    free_states: tuple[int, ...],
) -> jax.Array:
    """Derivatives of the outputs by theta[free] and x0[free_states]: (N // every, ny, len(free) + len(free_states))."""

    def of(change: jax.Array) -> jax.Array:
        moved_theta = theta.at[jnp.array(free, dtype=int)].add(change[: len(free)])
        moved_x0 = x0.at[jnp.array(free_states, dtype=int)].add(change[len(free) :])
        return _outputs(dynamics, every, time, inputs, moved_x0, moved_theta)

    jacobian: jax.Array = jax.jacfwd(of)(jnp.zeros(len(free) + len(free_states)))
    return jacobian


def outputs(model: StateSpaceModel, manoeuvre: ManoeuvreData, theta: Array, x0: Array | None = None) -> Array:
    """The modelled outputs (N // every, ny) from ``x0`` (nx,); None: from the manoeuvre's initial state."""
    start = manoeuvre.initial_state if x0 is None else x0
    return np.asarray(_outputs_jit(model.dynamics, manoeuvre.every, manoeuvre.time, manoeuvre.inputs, start, theta))


def sensitivities(
    model: StateSpaceModel,
    manoeuvre: ManoeuvreData,
    theta: Array,
    x0: Array,
    free: tuple[int, ...],
    free_states: tuple[int, ...] = (),
) -> Array:
    """The exact Jacobian (N // every, ny, n) of the outputs by the chosen parameters and initial states."""
    data = (manoeuvre.time, manoeuvre.inputs, jnp.asarray(x0), jnp.asarray(theta))
    return np.asarray(_sensitivities(model.dynamics, manoeuvre.every, *data, free, free_states))
