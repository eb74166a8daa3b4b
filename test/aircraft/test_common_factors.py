"""Estimates that are the file's times one factor. Truth: the file's derivatives, multiplied."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sysid_node.aircraft.common_factors import common_factors
from sysid_node.aircraft.load import load_aircraft

CDRW = load_aircraft("cdrw")
ALL = ("CL_", "CD_", "CY_", "Cl_", "Cm_", "Cn_")


def estimates(factors: dict[str, float], relative: float = 0.05, valid: bool = True) -> dict[str, SimpleNamespace]:
    """The file's derivatives, those whose name begins as a key multiplied by its factor."""
    found = {}
    for name, stated in CDRW.derivatives.items():
        factor = next((f for begin, f in factors.items() if name.startswith(begin)), 1.0)
        error = relative * abs(stated.value) * min(factor, 1.0)
        found[name] = SimpleNamespace(value=factor * stated.value, standard_error=error, valid=valid)
    return found


def test_those_of_the_file_show_nothing() -> None:
    assert common_factors(CDRW, estimates({})) == []
    assert common_factors(CDRW, {}) == []


@pytest.mark.parametrize("factor", [0.5, 2.0, 1000.0])
def test_a_wrong_mass_is_in_all_forces(factor: float) -> None:
    (said,) = common_factors(CDRW, estimates({"CL_": factor, "CD_": factor, "CY_": factor}))
    assert said.startswith(f"derivatives of lift and side force are all {factor:.2g} times those of 'cdrw'")
    assert f"is its mass of {CDRW.mass:g} kg right" in said


@pytest.mark.parametrize(("begin", "inertia"), [("Cl_", "Ixx"), ("Cm_", "Iyy"), ("Cn_", "Izz")])
def test_a_wrong_inertia_is_in_one_moment(begin: str, inertia: str) -> None:
    (said,) = common_factors(CDRW, estimates({begin: 2.0}))
    assert f"times those of 'cdrw': is {inertia} right?" in said


def test_a_wrong_area_is_in_everything() -> None:
    (said,) = common_factors(CDRW, estimates(dict.fromkeys(ALL, 0.5)))
    assert said.startswith("derivatives of forces and moments are all 0.5 times")
    assert "wing area, the airspeed and the air density" in said


def test_a_derivative_that_the_file_states_as_zero_tells_nothing() -> None:
    named = {**CDRW.derivatives, "CL_de": replace(CDRW.derivatives["CL_de"], value=0.0)}
    (said,) = common_factors(replace(CDRW, derivatives=named), estimates(dict.fromkeys(("CL_", "CD_", "CY_"), 2.0)))
    assert "is its mass" in said


def test_a_lateral_acceleration_in_g_is_in_the_side_force_alone() -> None:
    (said,) = common_factors(CDRW, estimates({"CY_": 0.1}))
    assert "is the lateral acceleration in g?" in said


def test_an_error_within_usual_tolerances_is_not_said() -> None:
    """The diagnosis weighs it; a warning would come too often."""
    assert common_factors(CDRW, estimates({"CL_": 1.3, "CD_": 1.3, "CY_": 1.3})) == []


def test_factors_of_their_own_are_no_common_one() -> None:
    """A file whose derivatives are known to a factor of two: never all alike."""
    random = np.random.default_rng(4)
    said = 0
    for _ in range(200):
        found = estimates({})
        for one in found.values():
            factor = float(np.exp(random.normal(0.0, np.log(2.0))))
            one.value, one.standard_error = factor * one.value, factor * one.standard_error
        said += bool(common_factors(CDRW, found))
    assert said <= 10


def test_what_is_not_valid_or_not_certain_shows_nothing() -> None:
    mass = {"CL_": 2.0, "CD_": 2.0, "CY_": 2.0}
    assert common_factors(CDRW, estimates(mass, valid=False)) == []
    assert common_factors(CDRW, estimates(mass, relative=0.6)) == []
