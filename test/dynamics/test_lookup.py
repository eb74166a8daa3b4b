"""Lookup tables against NumPy's and SciPy's interpolation, table by table."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import RegularGridInterpolator

from sysid_node.aircraft.model import LookupTable
from sysid_node.dynamics.lookup import interpolate, interpolate_with_slopes
from sysid_node.dynamics.packed_tables import PackedTables, coefficients_of, pack, variables_of
from sysid_node.sim.compiled import xla

xla.configure()  # float64

RANDOM = np.random.default_rng(4)
ALPHA, SPEED, RUDDER = (-0.2, 0.0, 0.05, 0.35), (10.0, 14.0, 25.0), (-0.3, 0.1, 0.4)
LONG = tuple(np.linspace(-0.5, 0.5, 9))


def table(coefficient, **points):
    """With random values."""
    values = RANDOM.standard_normal([len(each) for each in points.values()])
    return LookupTable(coefficient, tuple(points), tuple(points.values()), tuple(map(tuple, np.atleast_2d(values))))


def line(coefficient, name, points):
    return LookupTable(coefficient, (name,), (points,), tuple(RANDOM.standard_normal(len(points))))


#: Of one variable and of two, of different lengths and ends; some of one coefficient.
TABLES = (
    line("CL", "alpha", ALPHA),
    table("Cn", alpha=ALPHA, dr=RUDDER),
    table("Cn", dr=(-0.1, 0.2), alpha=(-0.1, 0.3)),
    line("Cn", "dr", LONG),
    line("Cm", "V", SPEED),
    line("CL", "alpha", LONG),
)
PLACES, PACKED = pack(TABLES)
VARIABLES, COEFFICIENTS = variables_of(PLACES), coefficients_of(PLACES)
#: Some beyond the ends.
SERIES = {
    "alpha": RANDOM.uniform(-0.6, 0.6, 300),
    "dr": RANDOM.uniform(-0.6, 0.6, 300),
    "V": RANDOM.uniform(5.0, 30.0, 300),
}
AT = np.stack([SERIES[name] for name in VARIABLES], -1)


def by_libraries(coefficient, at=AT):
    """The sum of the coefficient's tables, by ``numpy.interp`` and SciPy."""
    total, series = np.zeros(len(at)), dict(zip(VARIABLES, at.T, strict=True))
    for each in TABLES:
        if each.coefficient == coefficient:
            held = [np.clip(series[v], own[0], own[-1]) for v, own in zip(each.over, each.points, strict=True)]
            total += (
                np.interp(held[0], each.points[0], each.values)
                if len(held) == 1
                else RegularGridInterpolator(each.points, np.array(each.values))(np.stack(held, -1))
            )
    return total


def jax_tables():
    return PackedTables(*(jnp.asarray(part) for part in PACKED))


def test_each_coefficients_tables_are_added_up_as_the_libraries_interpolate_them():
    found = interpolate(PLACES, PACKED, AT, np)
    assert found.shape == (300, 3)
    for k, coefficient in enumerate(COEFFICIENTS):
        np.testing.assert_allclose(found[:, k], by_libraries(coefficient), atol=1e-13)


def test_jax_gives_the_same_for_series_and_for_numbers():
    expected = interpolate(PLACES, PACKED, AT, np)
    np.testing.assert_allclose(interpolate(PLACES, jax_tables(), jnp.asarray(AT), jnp), expected, atol=1e-13)
    one = interpolate(PLACES, jax_tables(), jnp.asarray(AT[5]), jnp)
    np.testing.assert_allclose(one, expected[5], atol=1e-13)


def test_jax_differentiates_through_the_tables():
    def found(at):
        return interpolate(PLACES, jax_tables(), at, jnp)

    slopes = jax.vmap(jax.jacfwd(found))(jnp.asarray(AT))
    np.testing.assert_allclose(slopes, interpolate_with_slopes(PLACES, PACKED, AT, np).slopes, atol=1e-11)


def test_the_slopes_are_the_libraries_differences_and_zero_beyond_the_ends():
    found, h = interpolate_with_slopes(PLACES, PACKED, AT, np), 1e-7
    np.testing.assert_array_equal(found.values, interpolate(PLACES, PACKED, AT, np))
    for v in range(len(VARIABLES)):
        step = h * (np.arange(len(VARIABLES)) == v)
        for c, coefficient in enumerate(COEFFICIENTS):
            differences = (by_libraries(coefficient, AT + step) - by_libraries(coefficient, AT - step)) / (2.0 * h)
            np.testing.assert_allclose(found.slopes[:, c, v], differences, atol=1e-6)
    beyond = np.abs(SERIES["alpha"]) > 0.5
    assert beyond.any()
    assert (found.slopes[beyond, COEFFICIENTS.index("CL"), VARIABLES.index("alpha")] == 0.0).all()


def test_a_point_of_a_table_belongs_to_the_interval_behind_it_and_the_last_to_the_one_before():
    curve = line("CL", "alpha", LONG)
    places, tables = pack([curve])
    expected = np.diff(curve.values) / np.diff(LONG)
    found = interpolate_with_slopes(places, tables, np.array(LONG)[:, None], np)
    np.testing.assert_allclose(found.slopes[:, 0, 0], [*expected, expected[-1]])
    np.testing.assert_allclose(found.values[:, 0], curve.values)
