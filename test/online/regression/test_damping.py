"""Motions that would amplify themselves; truth: the signs that were given."""

import numpy as np
import pytest

from sysid_node.online.regression.damping import amplified
from sysid_node.online.regression.normal_equations import ModelStructure, model_structure

LATERAL = ("0", "beta", "p", "r", "da", "dr")
STRUCTURE = model_structure({"Cm": ("0", "alpha", "q", "de"), "CY": LATERAL, "Cl": LATERAL, "Cn": LATERAL})


def found(structure: ModelStructure, coefficient: str, regressor: str, value: float, error: float) -> dict[int, str]:
    """With one derivative as given, all others are -1 +- 0.1."""
    theta = np.full((len(structure.regressors), len(structure.coefficients)), -1.0)
    variance = np.full_like(theta, 0.01)
    c = structure.coefficients.index(coefficient)
    i = next(i for i in structure.unknowns(c).tolist() if structure.regressors[i] == regressor)
    theta[i, c], variance[i, c] = value, error**2
    return amplified(structure, theta, variance)


@pytest.mark.parametrize(("coefficient", "rate", "control"), [("Cl", "p", "da"), ("Cm", "q", "de"), ("Cn", "r", "dr")])
def test_a_damping_that_is_surely_positive_is_told_with_its_control(coefficient, rate, control) -> None:
    assert found(STRUCTURE, coefficient, rate, 0.5, 0.2) == {STRUCTURE.coefficients.index(coefficient): control}


@pytest.mark.parametrize(("value", "error"), [(-0.5, 0.2), (0.5, 0.3)])
def test_one_that_is_negative_or_uncertain_is_not(value, error) -> None:
    assert found(STRUCTURE, "Cl", "p", value, error) == {}


@pytest.mark.parametrize(("coefficient", "regressor"), [("CY", "p"), ("Cl", "r"), ("Cn", "p"), ("Cl", "da")])
def test_other_derivatives_may_have_any_sign(coefficient, regressor) -> None:
    assert found(STRUCTURE, coefficient, regressor, 0.5, 0.1) == {}


def test_a_moment_without_that_rate_or_control_says_nothing() -> None:
    assert found(model_structure({"Cl": ("0", "beta", "r", "da")}), "Cl", "r", 0.5, 0.1) == {}
    assert found(model_structure({"Cl": ("0", "beta", "p")}), "Cl", "p", 0.5, 0.1) == {}
