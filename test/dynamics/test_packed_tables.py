"""Tables that are added up: how many are left, and that nothing is lost. What they amount to is ``test_lookup``'s."""

import numpy as np

from sysid_node.aircraft.model import LookupTable
from sysid_node.dynamics.lookup import interpolate
from sysid_node.dynamics.packed_tables import coefficients_of, pack, variables_of

LINE = LookupTable("CL", ("alpha",), ((-0.1, 0.2),), (1.0, 3.0))
OTHER = LookupTable("CL", ("alpha",), ((0.0, 0.1),), (0.0, 1.0))
PAIR = LookupTable("CL", ("alpha", "V"), ((-0.1, 0.1), (10.0, 20.0)), ((0.0, 1.0), (2.0, 3.0)))
TURNED = LookupTable("CL", ("V", "alpha"), ((10.0, 20.0), (-0.1, 0.1)), ((0.0, 2.0), (1.0, 3.0)))


def value(tables, **at):
    places, packed = pack(tables)
    return interpolate(places, packed, np.array([at[name] for name in variables_of(places)]), np)


def test_tables_over_the_same_variable_are_one():
    places, packed = pack([LINE, OTHER])
    assert places == (("CL", ("alpha",)),)
    np.testing.assert_array_equal(packed.points, [[-0.1, 0.0, 0.1, 0.2]])
    values = np.array([1.0, 1.0 + 2.0 / 3.0, 1.0 + 4.0 / 3.0 + 1.0, 4.0])
    np.testing.assert_allclose(packed.cells, [values[:-1], np.diff(values), [0.0] * 3, [0.0] * 3])


def test_a_table_over_one_variable_is_added_to_one_over_two():
    places, _ = pack([LINE, PAIR])
    assert places == (("CL", ("V", "alpha")),)
    np.testing.assert_allclose(value([LINE, PAIR], alpha=0.1, V=20.0), [3.0 + 1.0 + 4.0 / 3.0])
    np.testing.assert_allclose(value([PAIR, LINE], alpha=0.2, V=15.0), [2.5 + 3.0])


def test_the_order_of_two_variables_does_not_matter():
    places, _ = pack([PAIR, TURNED])
    assert len(places) == 1
    np.testing.assert_allclose(value([TURNED], alpha=0.02, V=13.0), value([PAIR], alpha=0.02, V=13.0))
    np.testing.assert_allclose(value([PAIR, TURNED], alpha=0.02, V=13.0), 2.0 * value([PAIR], alpha=0.02, V=13.0))


def test_tables_of_other_coefficients_stay_apart():
    moment = LookupTable("Cm", ("alpha",), ((-0.1, 0.2),), (5.0, 6.0))
    places, _ = pack([PAIR, moment])
    assert coefficients_of(places) == ["CL", "Cm"]
    np.testing.assert_allclose(value([PAIR, moment], alpha=0.2, V=10.0), [2.0, 6.0])


def test_points_that_differ_by_rounding_are_one():
    first = LookupTable("CL", ("throttle",), ((0.0, 0.15, 1.0),), (0.0, 1.0, 2.0))
    second = LookupTable("CD", ("throttle",), ((0.0, 0.15000000000000002, 1.0),), (0.0, 4.0, 2.0))
    _, packed = pack([first, second])
    assert packed.points.shape == (1, 3)
    np.testing.assert_allclose(value([first, second], throttle=0.15), [1.0, 4.0])


def test_a_jump_stays_a_jump():
    jump = LookupTable("CL", ("throttle",), ((0.0, 0.5, 0.5 + 1e-6, 1.0),), (0.0, 0.0, 1.0, 1.0))
    np.testing.assert_array_equal(value([jump], throttle=0.5), [0.0])
    np.testing.assert_array_equal(value([jump], throttle=0.50001), [1.0])
