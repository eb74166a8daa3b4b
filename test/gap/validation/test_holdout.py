"""Validation on flight not fitted. Truth: an explanation whose predictions are not finite explains nothing."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.diagnose import diagnose
from sysid_node.gap.validation.holdout import standing_explanation
from sysid_node.gap.validation.standard_errors import scattered_errors


@dataclass(frozen=True)
class Explanation:
    """As much of an attribution as the check of its numbers looks at; a matrix that is not positive predicts none."""

    corrected: Any
    chosen: Any = None
    causes: tuple[str, ...] = ("a cause",)
    smaller: tuple[float, ...] = ()  # with fewer causes
    is_favoured_by_derivatives: bool = False
    keeps_file_derivatives: bool = False
    strained: bool = False  # the derivatives, more than with more causes
    held: float | None = None  # with its insignificant sizes held at the file's values; none where it has none
    named: tuple["Explanation", ...] = ()  # those with fewer causes, where which are left matters
    beside_file: float = -1.0  # with the file's derivatives; of a matrix that is not positive nothing is predicted
    insignificant: bool = False  # of a cause nothing significant is left there
    sizes_of_file: bool = True  # there the sizes predict better that belong to them

    @property
    def labels(self) -> tuple[str, ...]:
        return self.causes

    def by_least_squares(self) -> "Explanation":
        return Explanation(self.chosen.fit)

    def with_fewer_causes(self) -> Iterator["Explanation"]:
        yield from self.named
        yield from (Explanation(size * np.eye(2), strained=self.strained) for size in self.smaller)

    def has_less_plausible_derivatives_than(self, larger: "Explanation") -> bool:
        return self.strained

    def with_file_derivatives(self, *, sizes: bool) -> "Explanation":
        better = self.beside_file if sizes is self.sizes_of_file else min(self.beside_file, 1.0)
        return replace(self, corrected=better * np.eye(2), keeps_file_derivatives=True, sizes_of_file=sizes)

    def has_insignificant_cause(self, _: object) -> bool:
        return self.insignificant

    def without_insignificant_sizes(self, _: object) -> "Explanation | None":
        return None if self.held is None else Explanation(self.held * np.eye(2))

    def without_causes(self) -> "Explanation":
        return Explanation(np.eye(2), causes=())


def by_cholesky(explanation: Explanation, *_: object) -> SimpleNamespace:
    """The larger, the better it predicts; 3 is as good as the file, for which 1.5 are the derivatives alone."""
    size = float(np.linalg.cholesky(explanation.corrected)[0, 0] ** 2)
    gaps = [SimpleNamespace(before=3.0, tolerances=1.5, after=3.0 / size, per_channel={})]
    found = SimpleNamespace(gaps=gaps, attitude={}, size=size)
    found.beside_file = lambda fitted: found
    return found


@pytest.mark.parametrize(
    ("unbiased", "least_squares", "stands"),
    [
        (9.0, 4.0, 9.0),
        (-1.0, 4.0, 4.0),  # of some fits no numbers come
        (0.5, 4.0, 4.0),  # worse than the file
        (-1.0, 1.5, 1.0),  # no better than the derivatives: nothing is blamed
        (-1.0, -1.0, 1.0),
    ],
)
def test_the_first_explanation_that_predicts_better_stands(
    unbiased: float, least_squares: float, stands: float
) -> None:
    chosen = SimpleNamespace(fit=least_squares * np.eye(2))
    _, checked = standing_explanation(Explanation(unbiased * np.eye(2), chosen), by_cholesky)
    assert checked.size == pytest.approx(stands)


def test_one_cause_that_predicts_nothing_does_not_take_the_other_with_it() -> None:
    wild = -np.eye(2)
    explanation = Explanation(wild, SimpleNamespace(fit=wild), ("sound", "wild"), smaller=(1.5, 4.0, 9.0))
    _, checked = standing_explanation(explanation, by_cholesky)
    assert checked.size == pytest.approx(4.0)  # the first of those with fewer causes that predicts better


@pytest.mark.parametrize(
    ("without", "strained", "stands"),
    [
        ((4.0, 9.0), False, 9.0),
        ((8.9, 4.0), False, 9.0),  # every cause is needed
        ((4.0, 9.5), False, 9.5),
        ((4.0, 9.5), True, 9.0),  # the derivatives moved in the cause's place
        ((9.2, 9.5, -1.0), False, 9.5),
    ],
)
def test_a_cause_without_which_other_flight_is_predicted_no_worse_is_left_out(
    without: tuple[float, ...], strained: bool, stands: float
) -> None:
    explanation = Explanation(9.0 * np.eye(2), causes=("one", "other"), smaller=without, strained=strained)
    found, checked = standing_explanation(explanation, by_cholesky)
    assert checked.size == pytest.approx(stands)
    assert len(found.causes) == (1 if not strained and max(without) >= 9.0 else 2)


@pytest.mark.parametrize(("alone", "stands"), [(9.5, ("delay", "bias")), (10.0, ("delay",)), (10.5, ("delay",))])
def test_a_cause_is_left_out_where_the_better_explanation_does_not_miss_it(
    alone: float, stands: tuple[str, ...]
) -> None:
    """A needless cause that spoils the whole explanation does not excuse another one's absence."""
    fewer = (Explanation(10.0 * np.eye(2), causes=("delay", "bias")), Explanation(alone * np.eye(2), causes=("delay",)))
    whole = Explanation(9.0 * np.eye(2), causes=("delay", "bias", "spoils"), named=fewer)
    found, _ = standing_explanation(whole, by_cholesky)
    assert found.causes == stands


@pytest.mark.parametrize("held", [-1.0, 8.9, None])
def test_sizes_without_which_other_flight_is_predicted_worse_stay(held: float | None) -> None:
    explanation = Explanation(9.0 * np.eye(2), held=held)
    found, checked = standing_explanation(explanation, by_cholesky)
    assert found is explanation and checked.size == pytest.approx(9.0)


@pytest.mark.parametrize("sizes", [True, False])
def test_the_files_derivatives_are_kept_where_causes_predict_better_beside_them(sizes: bool) -> None:
    """With the sizes that belong to them or those of the fit, whichever predict better."""
    explanation = Explanation(4.0 * np.eye(2), beside_file=16.0, sizes_of_file=sizes)
    found, checked = standing_explanation(explanation, by_cholesky)
    assert found.keeps_file_derivatives and found.sizes_of_file is sizes and checked.size == pytest.approx(16.0)


@pytest.mark.parametrize(("fewer", "stands"), [((), 4.0), ((3.9,), 4.0), ((4.1,), 4.1)])
def test_a_cause_of_which_nothing_is_left_beside_the_files_derivatives_is_no_reason_to_keep_these(
    fewer: tuple[float, ...], stands: float
) -> None:
    """Without it, or else with the fitted derivatives, whichever predicts flight that was not fitted better."""
    explanation = Explanation(4.0 * np.eye(2), SimpleNamespace(fit=-np.eye(2)), beside_file=16.0, insignificant=True)
    found, checked = standing_explanation(replace(explanation, smaller=fewer), by_cholesky)
    assert checked.size == pytest.approx(stands)
    assert not found.keeps_file_derivatives


@pytest.mark.slow
def test_sizes_that_no_flight_shows_are_those_of_the_file(aircraft) -> None:
    """The probe reads yaw and roll too; its bias of alpha alone is off in both flights."""
    biased = {"vane_bias": {"alpha": 0.05}}
    found = diagnose(aircraft, [fly(aircraft, biased, seed=5)], [fly(aircraft, biased, seed=6)])
    (cause,) = found.attribution.causes
    names = [found.attribution.corrected.simulator.parameters[i][1].name for i in cause.candidate.indices]
    sizes = dict(zip(names, found.attribution.corrected.values, strict=True))
    assert cause.candidate.effect == "vane_bias"
    assert sizes.pop("alpha") == pytest.approx(0.05, rel=0.1)
    assert [*sizes.values()] == [0.0]


def test_causes_beside_the_file_leave_the_derivatives_and_have_the_size_that_belongs_to_these(lagging) -> None:
    beside = lagging.attribution.with_file_derivatives(sizes=True)
    fit = beside.corrected
    (lag,) = fit.indices
    point = fit.flights[0].point
    assert beside.keeps_file_derivatives and point[lag] == beside.size_fit.values[0] == pytest.approx(0.08, rel=0.1)
    assert np.flatnonzero(point != fit.simulator.neutral()).tolist() == [lag]


def test_beside_the_files_derivatives_standard_errors_are_those_beside_the_fitted_ones(lagging) -> None:
    """Which are not less for derivatives that are held, nor more for what these then leave."""
    fitted = lagging.attribution.corrected
    beside = lagging.attribution.with_file_derivatives(sizes=True).size_fit
    assert scattered_errors(beside)[0] == pytest.approx(scattered_errors(fitted)[0], rel=0.02)
