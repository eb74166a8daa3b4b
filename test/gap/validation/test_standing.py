"""Whether an explanation stands, from errors made by hand; truth: each rule, tie and boundary."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.gap.validation.standing import (
    ErrorTable,
    causes_stand,
    file_derivatives_suit_causes,
    file_predicts_better,
    weather_accounts_for,
)

GOOD = ErrorTable(before=1.0, tolerances=0.5, after=0.1)


@pytest.mark.parametrize(
    ("errors", "stand"),
    [
        ([GOOD], True),
        ([GOOD, GOOD], True),
        ([GOOD, GOOD._replace(after=0.6)], True),  # better than the derivatives by one measure is enough
        ([GOOD._replace(after=0.6)], False),
        ([GOOD, GOOD._replace(after=1.1)], False),  # worse than the file by one measure is not
        ([GOOD._replace(after=0.6), GOOD._replace(after=0.6)], False),
        ([GOOD._replace(after=0.5)], False),  # a tie with the derivatives
        ([GOOD, GOOD._replace(tolerances=2.0, after=1.0)], False),  # a tie with the file
        ([GOOD._replace(tolerances=2.0, after=0.9)], True),
        ([GOOD._replace(after=float("nan"))], False),
    ],
)
def test_causes_predict_better_than_derivatives_and_file(errors: list[ErrorTable], stand: bool) -> None:
    assert causes_stand(errors) is stand


@pytest.mark.parametrize(("tolerances", "better"), [(0.9, False), (1.0, False), (1.0 + 1e-12, True)])
def test_the_file_predicts_better_by_one_measure(tolerances: float, better: bool) -> None:
    worse = GOOD._replace(tolerances=tolerances)
    assert file_predicts_better([worse]) is file_predicts_better([GOOD, worse]) is better


@pytest.mark.parametrize(("after", "suit"), [(0.3, True), (0.4, False), (0.5, False)])
def test_the_last_measure_decides_on_the_derivatives(after: float, suit: bool) -> None:
    """That of short simulated flights, where there is one."""
    fitted = [GOOD, GOOD._replace(after=0.4)]
    assert file_derivatives_suit_causes([GOOD._replace(after=9.0), GOOD._replace(after=after)], fitted) is suit


def test_weather_accounts_for_an_error_in_every_reading_or_not_at_all() -> None:
    floors = np.array([[1.0, 2.0], [3.0, 4.0]])  # means 2 and 3
    limit = THRESHOLDS.validation.chance**2 * np.array([2.0, 3.0])
    assert weather_accounts_for(limit, floors)
    assert not weather_accounts_for(limit * [1.0, 1.0 + 1e-12], floors)
    assert not weather_accounts_for(np.array([0.0, 100.0]), floors)
    lenient = replace(THRESHOLDS, validation=replace(THRESHOLDS.validation, chance=10.0))
    assert weather_accounts_for(np.array([0.0, 100.0]), floors, lenient)
