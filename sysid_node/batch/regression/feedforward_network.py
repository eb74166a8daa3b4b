"""A feed-forward network with one hidden layer, trained by least squares."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from sysid_node.flight.record import Array

_HIDDEN = 6


_DECAY = 1e-4  # weight decay: penalty of a weight of one, as a share of the outputs' variance


_SEED = 1


#: Matrix into the hidden layer, its bias, matrix out of it, matrix past it.
Weights = tuple[jax.Array, jax.Array, jax.Array, jax.Array]


def _network(weights: Weights, inputs: jax.Array) -> jax.Array:
    """One hidden layer with a linear path past it; inputs and outputs are standardised."""
    into, bias, out, linear = weights
    return jnp.tanh(inputs @ into + bias) @ out + inputs @ linear


@jax.jit
def network_output(weights: Weights, state: jax.Array, coefficients: jax.Array) -> jax.Array:
    """The network's output (N, k) from the state (N, m) and the coefficients (N, c), all standardised."""
    return _network(weights, jnp.concatenate([state, coefficients], axis=1))


@jax.jit
def network_slope(weights: Weights, state: jax.Array, coefficients: jax.Array) -> jax.Array:
    """The sensitivities (N, k, c) of the network's output to the coefficients."""
    single = lambda x, c: _network(weights, jnp.concatenate([x, c]))  # noqa: E731
    slope: jax.Array = jax.vmap(jax.jacfwd(single, argnums=1))(state, coefficients)
    return slope


def train_network(inputs: Array, target: Array) -> Weights:
    """The weights by least squares with weight decay on all but the linear path, from a seeded start."""
    n, k = inputs.shape[1], target.shape[1]
    shapes = ((n, _HIDDEN), (_HIDDEN,), (_HIDDEN, k), (n, k))
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])

    def unpack(flat: jax.Array) -> Weights:
        a, b, c, d = (part.reshape(s) for part, s in zip(jnp.split(flat, ends[:-1]), shapes, strict=True))
        return a, b, c, d

    def residual(flat: jax.Array) -> jax.Array:
        rest = (target - _network(unpack(flat), jnp.asarray(inputs))).ravel()
        return jnp.concatenate([rest, np.sqrt(_DECAY * len(target)) * flat[: ends[2]]])

    rng = np.random.default_rng(_SEED)
    linear = np.linalg.lstsq(inputs, target, rcond=None)[0]
    start = np.concatenate([0.3 * rng.standard_normal(ends[2]), linear.ravel()])
    value, slope = jax.jit(residual), jax.jit(jax.jacfwd(residual))

    def penalised(w: Array) -> Array:
        return np.asarray(value(w))

    def jacobian(w: Array) -> Array:
        return np.asarray(slope(w))

    solution = least_squares(penalised, start, jacobian, method="lm", max_nfev=60)
    return unpack(jnp.asarray(solution.x))
