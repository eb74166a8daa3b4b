"""Estimates that show another sign or unit of what was recorded. Truth: the aircraft file's derivatives, changed."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.opposite_estimates import opposite_estimates

CDRW = load_aircraft("cdrw")


def estimates(factors: dict[str, float], relative: float = 0.05, valid: bool = True) -> dict[str, SimpleNamespace]:
    """The file's derivatives, those whose name ends as a key multiplied by its factor."""
    values = {
        name: derivative.value * next((f for end, f in factors.items() if name.endswith(end)), 1.0)
        for name, derivative in CDRW.derivatives.items()
    }
    return {
        name: SimpleNamespace(value=value, standard_error=relative * abs(value), valid=valid)
        for name, value in values.items()
    }


def test_those_of_the_file_show_nothing() -> None:
    assert opposite_estimates(CDRW, estimates({})) == []
    assert opposite_estimates(CDRW, {}) == []


@pytest.mark.parametrize(("symbol", "name"), [("_de", "elevator"), ("_da", "aileron"), ("_dr", "rudder")])
def test_a_surface_counted_the_other_way(symbol: str, name: str) -> None:
    (said,) = opposite_estimates(CDRW, estimates({symbol: -1.0}))
    assert f"is {name} counted the other way" in said


def test_positions_from_minus_one_to_one() -> None:
    shares = {f"_{control.symbol}": control.limit for control in CDRW.controls.values()}
    (said,) = opposite_estimates(CDRW, estimates(shares))
    assert said.startswith("derivatives by elevator, aileron, rudder are 0.35, 0.35, 0.35 times")


def test_one_surface_that_lost_as_much_is_no_other_unit() -> None:
    assert opposite_estimates(CDRW, estimates({"_de": 0.35})) == []


def test_a_lateral_force_of_the_wrong_sign() -> None:
    (said,) = opposite_estimates(CDRW, estimates({"CY_beta": -1.0}))
    assert "is the sign of ay right" in said


def test_what_is_not_valid_or_not_certain_shows_nothing() -> None:
    assert opposite_estimates(CDRW, estimates({"_de": -1.0}, valid=False)) == []
    assert opposite_estimates(CDRW, estimates({"_de": -1.0}, relative=0.3)) == []


def test_an_aircraft_without_limits_shows_signs_alone() -> None:
    controls = {name: replace(control, limit=None) for name, control in CDRW.controls.items()}
    free = replace(CDRW, controls=controls)
    assert opposite_estimates(free, estimates({"_de": 0.35, "_da": 0.35, "_dr": 0.35})) == []
    assert len(opposite_estimates(free, estimates({"_de": -1.0}))) == 1
