"""The next step of the stepwise replacement, from tables made by hand; truth: each rule, tie and boundary."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.selection.acceptance import AddedSize, ChannelScores, ComparisonTable, RemainingPower
from sysid_node.gap.selection.replacement import (
    AlternativeTable,
    PositionTable,
    Step,
    are_alike,
    are_as_stated,
    next_step,
)
from sysid_node.gap.thresholds import THRESHOLDS

ACCEPTED = ComparisonTable(
    AddedSize(time=None, sample_period=0.01), probability=0.99,
    channels=ChannelScores(np.ones(12), RemainingPower(np.full(12, 0.1), np.zeros(12)), contribution=np.ones(12)),
    log_bayes_factor=50.0, searched=30,
)  # fmt: skip
REJECTED = replace(ACCEPTED, probability=0.5)
LEAD = THRESHOLDS.search.lead


def cause(*alternatives: AlternativeTable, needed: bool = True, score_without: float = -100.0) -> PositionTable:
    return PositionTable(ACCEPTED if needed else REJECTED, score_without, alternatives)


def alternative(label: str, lead: float, accepted: bool = True) -> AlternativeTable:
    return AlternativeTable(label, ACCEPTED if accepted else REJECTED, lead)


def test_an_explanation_without_better_alternatives_is_kept() -> None:
    assert next_step([]) is None
    assert next_step([cause(), cause()]) is None
    assert next_step([cause(alternative("cg_shift", -5.0)), cause(alternative("mass_error", 0.5))]) is None


def test_a_cause_that_is_not_needed_is_dropped() -> None:
    assert next_step([cause(), cause(needed=False)]) == Step(1)


def test_a_single_cause_is_not_dropped() -> None:
    assert next_step([cause(needed=False)]) is None


@pytest.mark.parametrize(("scores", "position"), [((-100.0, -90.0), 1), ((-90.0, -100.0), 0), ((-90.0, -90.0), 0)])
def test_of_several_the_one_whose_absence_predicts_best_is_dropped(scores: tuple[float, float], position: int) -> None:
    """In a tie the first."""
    first, second = (cause(needed=False, score_without=score) for score in scores)
    assert next_step([first, second]) == Step(position)


def test_dropping_comes_before_replacing() -> None:
    assert next_step([cause(alternative("cg_shift", 100.0)), cause(needed=False)]) == Step(1)


def test_the_alternative_with_the_largest_lead_takes_the_place() -> None:
    positions = [
        cause(alternative("cg_shift", 2.0), alternative("mass_error", 7.0)),
        cause(alternative("air_data_lag", 5.0)),
    ]
    assert next_step(positions) == Step(0, 1)
    assert next_step(positions, frozenset({"mass_error"})) == Step(1, 0)
    assert next_step(positions, frozenset({"mass_error", "air_data_lag"})) == Step(0, 0)
    assert next_step(positions, frozenset({"mass_error", "air_data_lag", "cg_shift"})) is None


def test_in_a_tie_the_first_alternative_takes_the_place() -> None:
    positions = [cause(alternative("cg_shift", 2.0)), cause(alternative("mass_error", 2.0))]
    assert next_step(positions) == Step(0, 0)


@pytest.mark.parametrize(("change", "step"), [(-1e-9, None), (0.0, None), (1e-9, Step(0, 0))])
def test_boundary_of_the_lead(change: float, step: Step | None) -> None:
    assert next_step([cause(alternative("cg_shift", LEAD + change))]) == step


def test_an_alternative_that_is_not_accepted_takes_no_place() -> None:
    assert next_step([cause(alternative("cg_shift", 100.0, accepted=False))]) is None


def test_effects_that_add_up_stand_beside_each_other() -> None:
    """Up to the three causes that an explanation may have; where it has them, the next alternative is asked."""
    both = replace(alternative("cg_shift", 7.0), leaves_cause=True, adds_up=True)
    positions = [cause(both, alternative("mass_error", 5.0)), cause()]
    assert next_step(positions) == Step(0, 0, beside=True)
    assert next_step([*positions, cause()]) == Step(0, 1)
    assert next_step([cause(both), cause(), cause()]) is None


def test_an_alternative_beside_which_the_cause_is_needed_takes_no_place() -> None:
    """It is not needed beside the cause, so the cause stands alone."""
    beside = replace(alternative("vane_lever_arm", 7.0), leaves_cause=True)
    assert next_step([cause(beside)]) is None
    assert next_step([cause(beside, alternative("cg_shift", 5.0))]) == Step(0, 1)


def test_a_larger_lead_may_be_asked_for() -> None:
    strict = replace(THRESHOLDS, search=replace(THRESHOLDS.search, lead=10.0))
    positions = [cause(alternative("cg_shift", 5.0))]
    assert (next_step(positions), next_step(positions, thresholds=strict)) == (Step(0, 0), None)


def test_of_two_variants_of_an_effect_the_simpler_takes_the_place_unless_the_other_leads_clearly():
    """Penalty: 10 of deviance, 5 nats, a parameter (``thresholds.Search.penalty``); two parameters fewer here."""

    def variant(lead: float, fewer: int) -> AlternativeTable:
        return AlternativeTable("a variant", ACCEPTED, lead, fewer)

    assert next_step([cause(variant(-8.0, 2))]) == Step(0, 0)
    assert next_step([cause(variant(-9.5, 2))]) is None  # it lags by more than 10 nats less the lead of 1
    assert next_step([cause(variant(8.0, -2))]) is None
    assert next_step([cause(variant(11.5, -2))]) == Step(0, 0)
    assert next_step([cause(variant(8.0, 0))]) == Step(0, 0)


def test_a_variant_whose_sizes_are_alike_gives_way_to_the_simpler_one_and_does_not_come_back():
    assert next_step([cause(AlternativeTable("all alike", ACCEPTED, -15.0, 2, True))]) == Step(0, 0)
    assert next_step([cause(AlternativeTable("each by itself", ACCEPTED, 15.0, -2, True))]) is None
    assert next_step([cause(AlternativeTable("another effect", ACCEPTED, -15.0, 0, True))]) is None


def test_one_slow_servo_is_enough_where_the_others_are_as_the_file_states_them():
    """By 1.96 sigma of the standard error, of a stamp's (the period over the root of 12) and of 3 % of the size."""
    errors = np.array([0.001, 0.001])
    assert are_as_stated(np.array([0.0019, -0.0019]), np.zeros(2), errors)
    assert not are_as_stated(np.array([0.0, 0.0021]), np.zeros(2), errors)
    assert are_as_stated(np.array([-0.005, 0.005]), np.zeros(2), errors, period=0.01)
    assert not are_as_stated(np.array([0.0, 0.0065]), np.zeros(2), errors, period=0.01)
    assert are_as_stated(np.array([1.05]), np.array([1.0]), np.zeros(1))
    assert not are_as_stated(np.array([1.07]), np.array([1.0]), np.zeros(1))


def test_where_all_servos_are_slow_no_single_one_is_enough():
    """All alike take the place of each by itself, although one alone is accepted, too."""
    slow, unlike = np.array([0.08, 0.081, 0.079]), np.array([0.08, 0.12, 0.05])
    errors = np.full(2, 0.001)

    def variant(label: str, fewer: int, enough: bool) -> AlternativeTable:
        return AlternativeTable(label, ACCEPTED, -50.0, fewer, enough)

    for sizes, step in ((slow, Step(0, 0)), (unlike, None)):
        one = are_as_stated(sizes[1:], np.zeros(2), errors, period=0.01)
        assert next_step([cause(variant("all", 2, are_alike(sizes)), variant("of one", 2, one))]) == step
