"""Derivatives that lookup tables amount to: a linear table is a derivative, a bent one its slope in level flight."""

from dataclasses import replace

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import LookupTable
from sysid_node.dynamics.linearised import linear_derivatives, table_derivatives, trimmed

AIRCRAFT = load_aircraft("kestrel")
FILE = {name: derivative.value for name, derivative in AIRCRAFT.derivatives.items()}


def linear(coefficient: str, over: str, slope: float) -> LookupTable:
    return LookupTable(coefficient, (over,), ((-1.0, 0.0, 1.0),), (-slope, 0.0, slope))


def test_without_tables_they_are_the_files() -> None:
    assert linear_derivatives(AIRCRAFT) == FILE
    assert table_derivatives(AIRCRAFT) == {}


def test_a_derivative_may_as_well_be_a_table() -> None:
    """Half of some derivatives as tables: the same linear model and the same level flight at two dynamic pressures."""
    moved = {"CL_alpha": "alpha", "Cm_alpha": "alpha", "Cm_de": "de", "Cl_p": "p", "Cn_beta": "beta"}
    less = {n: replace(d, value=d.value * (0.5 if n in moved else 1.0)) for n, d in AIRCRAFT.derivatives.items()}
    tables = tuple(linear(name.partition("_")[0], over, 0.5 * FILE[name]) for name, over in moved.items())
    aircraft = replace(AIRCRAFT, derivatives=less, tables=tables)
    assert linear_derivatives(aircraft) == pytest.approx(FILE, abs=1e-9)
    for pressure in (0.7, 1.5):
        assert trimmed(aircraft, pressure) == pytest.approx(trimmed(AIRCRAFT, pressure), abs=1e-9)


def test_tables_over_the_throttle_are_left_out() -> None:
    table = LookupTable("Cm", ("alpha", "throttle"), ((-1.0, 1.0), (0.0, 1.0)), ((0.1, 0.2), (0.3, 0.5)))
    assert linear_derivatives(replace(AIRCRAFT, tables=(table,))) == FILE


def test_a_bent_table_counts_with_its_slope_in_level_flight() -> None:
    """Both equations of the trim hold on the table, and on the linear model at the trim's angle of attack."""
    bend = trimmed(AIRCRAFT)[0] - 0.02
    aircraft = replace(
        AIRCRAFT, tables=(LookupTable("Cm", ("alpha",), ((bend - 1.0, bend, bend + 1.0),), (0.0, 0.0, -0.8)),)
    )
    alpha, elevator = trimmed(aircraft)
    assert alpha > bend
    pitching = FILE["Cm_0"] + FILE["Cm_alpha"] * alpha + FILE["Cm_de"] * elevator - 0.8 * (alpha - bend)
    assert pitching == pytest.approx(0.0, abs=1e-9)
    found = linear_derivatives(aircraft)
    assert found["Cm_alpha"] == pytest.approx(FILE["Cm_alpha"] - 0.8)
    assert found["Cm_0"] + found["Cm_alpha"] * alpha + found["Cm_de"] * elevator == pytest.approx(0.0, abs=1e-9)
