"""What flight not fitted says of an explanation. Truth: an explanation of which no numbers come explains nothing."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap import holdout
from sysid_node.gap.diagnose import diagnose

WRONG = {"Cm_alpha": 0.015, "Cm_de": 0.04, "CL_alpha": -0.2, "Cl_p": 0.03, "Cn_beta": 0.006, "Cl_da": 0.02}


@dataclass(frozen=True)
class Explanation:
    """As much of an attribution as the check of its numbers looks at."""

    corrected: Any
    least_squares: Any
    chosen: Any = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "chosen", SimpleNamespace(fit=self.least_squares))

    def without_causes(self) -> "Explanation":
        return Explanation(np.eye(2), np.eye(2))


@pytest.fixture
def checked_by_cholesky(monkeypatch: pytest.MonkeyPatch) -> None:
    """The check of an explanation: the root of its matrix, of which there is none where it is not positive."""
    monkeypatch.setattr(holdout, "check", lambda explanation, *_: np.linalg.cholesky(explanation.corrected))


@pytest.mark.usefixtures("checked_by_cholesky")
def test_causes_that_predict_no_numbers_are_given_up() -> None:
    """As slopes of a mode that feeds itself on flight not fitted, without end."""
    left, checked = holdout._checked(Explanation(-np.eye(2), -np.eye(2)), (), ())
    assert np.array_equal(left.corrected, np.eye(2)) and np.array_equal(checked, np.eye(2))


@pytest.mark.usefixtures("checked_by_cholesky")
def test_sizes_of_least_squares_stand_where_the_unbiased_ones_predict_no_numbers() -> None:
    left, checked = holdout._checked(Explanation(-np.eye(2), 4.0 * np.eye(2)), (), ())
    assert np.array_equal(left.corrected, 4.0 * np.eye(2)) and np.array_equal(checked, 2.0 * np.eye(2))


def test_causes_beside_the_file_keep_their_size_and_leave_the_derivatives(aircraft) -> None:
    flights = [fly(aircraft, {"actuator_lag": {"time_constant": 0.08}, "derivative_error": WRONG}, s) for s in (5, 6)]
    attribution = diagnose(aircraft, flights[:1], flights[1:]).attribution
    beside = attribution.beside_the_file()
    fit = beside.corrected
    (lag,) = fit.indices
    assert beside.filed and fit.points[0][lag] == attribution.corrected.points[0][lag] == pytest.approx(0.08, rel=0.1)
    assert np.flatnonzero(fit.points[0] != fit.views[0].simulator.neutral()).tolist() == [lag]


def test_a_single_flight_with_each_manoeuvre_once_is_checked_on_its_parts(aircraft) -> None:
    """Each part then holds what no other does; a lag that moved every reading must not be lost for that."""
    steps = ["3211:elevator:start=2", "3211:aileron:start=14", "3211:rudder:start=26"]
    flight = fly(aircraft, {"actuator_lag": {"time_constant": 0.09}}, seed=3, manoeuvre=steps, duration=40.0)
    found = diagnose(aircraft, [flight], [])
    assert [cause.candidate.effect for cause in found.attribution.causes] == ["actuator_lag"]
    assert found.size.after < 0.7 * found.size.before
