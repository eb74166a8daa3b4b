"""Sizes of faults in simulated flights whose derivatives are off by draws from their tolerances, beside the truth."""

import numpy as np
import pytest

from bench.estimation.faults import CASES, Case, watched

SEEDS = (11, 12, 13, 14)


def case_of(name: str) -> Case:
    return next(case for case in CASES if case.name == name)


@pytest.mark.slow
def test_a_stuck_elevator_in_turbulence_is_where_its_interval_says() -> None:
    """The aircraft flies at another angle of attack afterwards, and gusts have biased what was learned about it."""
    case = case_of("elevator stuck at +3 deg")
    for seen in watched(case, "moderate", SEEDS, "", 50.0):
        assert seen.names(case)
        assert seen.lower <= case.size <= seen.upper


@pytest.mark.slow
def test_a_large_error_of_a_vane_is_not_judged_by_that_of_a_small_one() -> None:
    """By 3 deg the drag does not shift in proportion; a linear shift said 7 % too much."""
    case = case_of("alpha vane off by 3 deg")
    seen = watched(case, "none", SEEDS, "", 50.0)
    assert all(one.names(case) for one in seen)
    assert np.mean([one.size for one in seen]) == pytest.approx(case.size, rel=0.04)
