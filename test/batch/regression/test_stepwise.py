"""Stepwise regression finds what made the data, and nothing else."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, clean, flight

from sysid_node.aircraft.model import Derivative
from sysid_node.batch.regression.stepwise import CRITERIA, select_regressors, supported_model
from sysid_node.errors import InputError

NAMES = ("0", "a", "b", "c", "d")


def data(seed, samples=1000):
    rng = np.random.default_rng(seed)
    X = np.column_stack([np.ones(samples), np.cumsum(rng.normal(size=(samples, 4)), axis=0) / 10.0])
    return X @ [0.3, 2.0, 0.0, -1.0, 0.0] + 0.3 * rng.normal(size=samples), X


@pytest.mark.parametrize("criterion", CRITERIA)
def test_what_made_the_data_is_found(criterion):
    y, X = data(1)
    chosen = select_regressors(NAMES, [y], [X], criterion=criterion).regressors
    assert {"0", "a", "c"} <= set(chosen)


def test_the_f_ratio_lets_few_others_in():
    wrong = sum(len(select_regressors(NAMES, [y], [X]).regressors) - 3 for y, X in map(data, range(20)))
    assert wrong <= 3  # of 40 chances


def test_steps_are_told_with_their_merits():
    y, X = data(2)
    steps = select_regressors(NAMES, [y], [X]).steps
    assert [step.change for step in steps[:3]] == ["", "+a", "+c"] or [s.change for s in steps[:3]] == ["", "+c", "+a"]
    assert steps[2].r_squared > steps[1].r_squared > steps[0].r_squared
    assert steps[2].predicted_square_error < steps[1].predicted_square_error
    assert steps[2].cross_validation < steps[1].cross_validation


def test_a_stand_in_leaves_once_the_real_thing_is_there():
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 1000))
    both = a + b + 0.3 * rng.normal(size=1000)  # first choice, superfluous with a and b
    X = np.column_stack([np.ones(1000), a, b, both])
    selection = select_regressors(("0", "a", "b", "both"), [a + b + 0.1 * rng.normal(size=1000)], [X])
    assert selection.regressors == ("0", "a", "b")
    assert [step.change for step in selection.steps][-1] == "-both"


def test_the_aircraft_keeps_the_derivatives_that_the_flights_support():
    extra = {**KESTREL.derivatives, "Cm_beta": Derivative(0.0)}  # symmetric: there is none
    smaller, selections = supported_model(
        dataclasses.replace(KESTREL, derivatives=extra), [clean(), flight(1, turn=-1)]
    )
    assert "Cm_beta" not in smaller.derivatives
    assert {"Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cn_dr"} <= set(smaller.derivatives)
    assert "beta" not in selections["Cm"].regressors


def test_an_unknown_criterion_is_refused():
    y, X = data(4)
    with pytest.raises(InputError, match="criterion 'aic': expected one of f_ratio"):
        select_regressors(NAMES, [y], [X], criterion="aic")
