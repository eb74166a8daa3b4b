"""What lookup tables add, as numbers and as columns, against NumPy's and SciPy's interpolation."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from sysid_node.aircraft.model import LookupTable
from sysid_node.dynamics import scalar
from sysid_node.dynamics.tables import array_tables, scalar_tables, table_variables

X, Y = (-0.2, 0.0, 0.05, 0.35), (-0.3, 0.1, 0.4)
RANDOM = np.random.default_rng(7)
ONE = LookupTable("CL", ("alpha",), (X,), tuple(RANDOM.standard_normal(len(X)).tolist()))
TWO = LookupTable("CL", ("alpha", "de"), (X, Y), tuple(map(tuple, RANDOM.standard_normal((len(X), len(Y))).tolist())))
ROLL = LookupTable("Cl", ("p",), (Y,), (0.3, -0.1, 0.2))
AT = {
    name: np.concatenate([RANDOM.uniform(-0.6, 0.6, 300), corners])
    for name, corners in (("alpha", [*X, *X]), ("de", [*Y, *Y, -0.0, 9.0]), ("p", [*Y, *Y, 0.0, -9.0]))
}


def test_tables_of_a_coefficient_add_up_and_are_held_beyond_the_ends() -> None:
    found = array_tables((ONE, TWO, ROLL))(AT)
    held = np.column_stack([np.clip(AT["alpha"], X[0], X[-1]), np.clip(AT["de"], Y[0], Y[-1])])
    lift = np.interp(AT["alpha"], X, ONE.values) + RegularGridInterpolator((X, Y), np.array(TWO.values))(held)
    np.testing.assert_allclose(found["CL"], lift, atol=1e-14)
    np.testing.assert_allclose(found["Cl"], np.interp(AT["p"], Y, ROLL.values), atol=1e-14)
    assert set(found) == {"CL", "Cl"}


def test_numbers_and_columns_give_the_same_bits() -> None:
    many, one = array_tables((ONE, TWO, ROLL))(AT), scalar_tables((ONE, TWO, ROLL))
    rows = [dict(zip(AT, values, strict=True)) for values in zip(*(x.tolist() for x in AT.values()), strict=True)]
    for coefficient, column in many.items():
        assert column.tobytes() == np.array([one(row)[coefficient] for row in rows]).tobytes()


def test_variables_are_non_dimensional_rates_and_the_mach_number() -> None:
    """At sea level, sound travels at 340.294 m/s (ICAO Doc 7488); rates by b / 2V and cbar / 2V."""
    found = table_variables((34.0294, 0.1, 0.0), (1.0, 2.0, 3.0), 2.0, 0.5, 1.225, scalar)
    assert found["Mach"] == pytest.approx(0.1, rel=1e-6)
    assert [found[n] * 34.0294 for n in "pqr"] == pytest.approx([1.0, 0.5, 3.0])
    assert "Mach" not in table_variables((34.0294, 0.1, 0.0), (1.0, 2.0, 3.0), 2.0, 0.5, None, scalar)
