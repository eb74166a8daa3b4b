"""Derivatives and tables of a function. Truth: polynomials, whose parts are known."""

import numpy as np
import pytest

from sysid_node.sim.importing.expansion import TableAxis, evaluate, expand, largest_error, thinned

AXES = {
    "alpha": TableAxis.of(np.linspace(-0.2, 0.3, 11), 0.05, 1e-3),
    "q": TableAxis.of([-0.02, 0.0, 0.02], 0.0, 1e-3),
    "V": TableAxis.of([15.0, 18.0, 20.0, 22.0], 20.0, 0.1),
    "de": TableAxis.of([-0.3, 0.0, 0.3], -0.04, 1e-3),
}


def polynomial(x):
    """CL is linear; CD has a square; Cm has a product of two variables and depends on V; Cn has one of three."""
    a, q, V, de = x["alpha"], x["q"], x["V"], x["de"]
    zero = np.zeros_like(a)
    Cm = 0.1 - 0.5 * a - 8.0 * q - 0.9 * de + 0.7 * a * de + 0.002 * (V - 20.0)
    return np.column_stack([0.2 + 5.0 * a + 3.0 * q, 0.03 + 0.4 * a**2, zero, zero, Cm, a * q * de])


EXPANSION = expand(polynomial, AXES, np.full(6, 1e-9))


def test_what_is_linear_is_a_derivative():
    found = EXPANSION.derivatives
    assert {n for n in found if n.startswith("CL")} == {"CL_0", "CL_alpha", "CL_q"}
    assert found["CL_0"] == pytest.approx(0.2)
    assert found["CL_alpha"] == pytest.approx(5.0)
    assert found["Cm_alpha"] == pytest.approx(-0.5 + 0.7 * -0.04)  # at the centre's elevator
    assert not [t for t in EXPANSION.tables if t.coefficient == "CL"]


def test_everything_else_is_tables_exact_at_their_points():
    assert {(t.coefficient, t.over) for t in EXPANSION.tables} >= {
        ("CD", ("alpha",)),
        ("Cm", ("alpha", "de")),
        ("Cm", ("V",)),
    }
    points = np.meshgrid(AXES["alpha"].nodes, AXES["de"].nodes, indexing="ij")
    x = {"alpha": points[0].ravel(), "de": points[1].ravel()}
    x |= {"q": np.zeros(x["alpha"].size), "V": np.full(x["alpha"].size, 20.0)}
    np.testing.assert_allclose(evaluate(EXPANSION, x), polynomial(x), atol=1e-9)


def test_a_product_is_a_table_of_its_corners():
    (table,) = [t for t in EXPANSION.tables if t.over == ("alpha", "de") and t.coefficient == "Cm"]
    assert np.shape(table.values) == (2, 2)


def test_what_three_variables_do_together_is_measured():
    error, _ = largest_error(polynomial, EXPANSION, AXES, 1.0, 2000)
    assert error[5] == pytest.approx(0.25 * 0.02 * 0.34, rel=0.3)  # the largest product about the centre
    assert error[0] < 1e-9


def test_a_variable_that_does_nothing_has_no_entry():
    assert not [n for n in EXPANSION.derivatives if n.startswith(("CY", "Cl")) and not n.endswith("_0")]


def test_thinning_keeps_the_corners_of_a_broken_line():
    nodes = np.linspace(0.0, 1.0, 11)
    values = np.maximum(nodes - 0.4, 0.0)[:, None]
    assert nodes[thinned(nodes, values, 1e-9)] == pytest.approx([0.0, 0.4, 1.0])
