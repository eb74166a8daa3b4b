"""Lookup tables against NumPy's and SciPy's interpolation."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import RegularGridInterpolator

from sysid_node.dynamics.lookup import PackedTables, interpolate, interpolate_with_slopes, pack

X = np.array([-0.2, 0.0, 0.05, 0.35])
Y = np.array([-0.3, 0.1, 0.4])
RANDOM = np.random.default_rng(4)
AT = RANDOM.uniform(-0.6, 0.6, (200, 2))
LINE, GRID, LONG = RANDOM.standard_normal(X.size), RANDOM.standard_normal((X.size, Y.size)), RANDOM.standard_normal(9)
LONG_X = np.linspace(-0.5, 0.5, 9)

#: Of one variable and of two, of different lengths.
TABLES = pack([((X,), LINE), ((X, Y), GRID), ((LONG_X,), LONG)])


def looked_up(xp=np, tables=TABLES, at=AT):
    return interpolate(tables, xp.stack([at[:, 0]] * 3, -1), xp.stack([at[:, 0], at[:, 1], at[:, 0]], -1), xp)


def test_one_variable_is_numpys_interpolation_held_beyond_the_ends():
    found = looked_up()
    np.testing.assert_allclose(found[:, 0], np.interp(AT[:, 0], X, LINE), atol=1e-14)
    np.testing.assert_allclose(found[:, 2], np.interp(AT[:, 0], LONG_X, LONG), atol=1e-14)


def test_two_variables_are_scipys_bilinear_interpolation():
    held = np.column_stack([np.clip(AT[:, 0], X[0], X[-1]), np.clip(AT[:, 1], Y[0], Y[-1])])
    np.testing.assert_allclose(looked_up()[:, 1], RegularGridInterpolator((X, Y), GRID)(held), atol=1e-14)


def test_jax_gives_the_same_for_series_and_for_scalars():
    tables = PackedTables(*(jnp.asarray(part) for part in TABLES))
    np.testing.assert_allclose(looked_up(jnp, tables, jnp.asarray(AT)), looked_up(), atol=1e-12)
    one = interpolate(tables, jnp.asarray(AT[5, [0, 0, 0]]), jnp.asarray(AT[5, [0, 1, 0]]), jnp)
    np.testing.assert_allclose(one, looked_up()[5], atol=1e-12)


def test_the_slope_is_that_of_the_interval():
    tables = PackedTables(*(jnp.asarray(part) for part in TABLES))
    slope = jax.grad(lambda x: interpolate(tables, jnp.full(3, x), jnp.zeros(3), jnp)[0])(0.2)
    np.testing.assert_allclose(slope, (LINE[3] - LINE[2]) / (X[3] - X[2]))


def test_the_slopes_are_the_differences_within_an_interval_and_zero_beyond_the_ends():
    first, second = np.stack([AT[:, 0]] * 3, -1), np.stack([AT[:, 0], AT[:, 1], AT[:, 0]], -1)
    found, h = interpolate_with_slopes(TABLES, first, second, np), 1e-7
    by_first, by_second = (
        (interpolate(TABLES, first + a, second + b, np) - interpolate(TABLES, first - a, second - b, np)) / (2.0 * h)
        for a, b in ((h, 0.0), (0.0, h))
    )
    np.testing.assert_allclose(found.by_first, by_first, atol=1e-6)
    np.testing.assert_allclose(found.by_second, by_second, atol=1e-6)
    beyond = (first[:, 0] < X[0]) | (first[:, 0] > X[-1])
    assert beyond.any()
    assert (found.by_first[beyond, :2] == 0.0).all()


def test_a_point_of_a_table_belongs_to_the_interval_behind_it():
    tables = pack([((LONG_X,), LONG), (([0.0, 2.0],), [1.0, 5.0])])
    for place, slope in zip(LONG_X[:-1], np.diff(LONG) / np.diff(LONG_X), strict=True):
        found = interpolate_with_slopes(tables, np.array([place, 0.5]), np.zeros(2), np)
        np.testing.assert_allclose(found.by_first, [slope, 2.0])
        np.testing.assert_allclose(found.values, [LONG[np.searchsorted(LONG_X, place)], 2.0])
