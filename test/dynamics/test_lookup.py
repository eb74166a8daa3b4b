"""Lookup tables against NumPy's and SciPy's interpolation."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import RegularGridInterpolator

from sysid_node.dynamics.lookup import interpolate

X = np.array([-0.2, 0.0, 0.05, 0.35])
Y = np.array([-0.3, 0.1, 0.4])
RANDOM = np.random.default_rng(4)
AT = RANDOM.uniform(-0.6, 0.6, (200, 2))


def test_one_variable_is_numpys_interpolation_held_beyond_the_ends():
    values = RANDOM.standard_normal(X.size)
    np.testing.assert_allclose(interpolate([X], values, [AT[:, 0]], np), np.interp(AT[:, 0], X, values), atol=1e-14)


def test_two_variables_are_scipys_bilinear_interpolation():
    values = RANDOM.standard_normal((X.size, Y.size))
    held = np.column_stack([np.clip(AT[:, 0], X[0], X[-1]), np.clip(AT[:, 1], Y[0], Y[-1])])
    expected = RegularGridInterpolator((X, Y), values)(held)
    np.testing.assert_allclose(interpolate([X, Y], values, [AT[:, 0], AT[:, 1]], np), expected, atol=1e-14)
    scalar = interpolate(
        [jnp.asarray(X), jnp.asarray(Y)], jnp.asarray(values), [jnp.asarray(0.02), jnp.asarray(0.2)], jnp
    )
    np.testing.assert_allclose(scalar, RegularGridInterpolator((X, Y), values)([0.02, 0.2])[0], atol=1e-14)


def test_the_slope_is_that_of_the_interval():
    values = RANDOM.standard_normal(X.size)
    slope = jax.grad(lambda x: interpolate([jnp.asarray(X)], jnp.asarray(values), [x], jnp))(0.2)
    np.testing.assert_allclose(slope, (values[3] - values[2]) / (X[3] - X[2]))
