"""Which causes are kept, from tables made by hand; truth: each rule, tie and boundary, and sums of probabilities."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid_node.gap.selection.acceptance import (
    AddedSize,
    ChannelScores,
    ComparisonScores,
    ComparisonTable,
    RemainingPower,
)
from sysid_node.gap.selection.retention import (
    CauseTable,
    Challenge,
    combined_shares,
    kept_causes,
    next_challenge,
    shares_by_effect,
    successor,
)
from sysid_node.gap.thresholds import THRESHOLDS

ACCEPTED = ComparisonTable(
    AddedSize(time=None, sample_period=0.01), probability=0.99,
    channels=ChannelScores(np.ones(12), RemainingPower(np.full(12, 0.1), np.zeros(12)), contribution=np.ones(12)),
    log_bayes_factor=50.0, searched=30,
)  # fmt: skip
LIKELY = THRESHOLDS.calibration.probability

LAG = CauseTable("actuator_lag", share=0.9, alternative_share=0.1, probability=0.95, by_support=0.95)
MASS = CauseTable("mass_error", share=0.8, alternative_share=0.2, probability=0.7, by_support=0.7)


def test_probable_causes_are_kept() -> None:
    assert next_challenge([]) is None
    assert next_challenge([LAG, MASS]) is None


def test_a_likelier_alternative_challenges_first_and_once() -> None:
    """Even where another cause is improbable."""
    second = replace(MASS, share=0.4, alternative_share=0.6)
    improbable = replace(LAG, probability=0.1)
    assert next_challenge([improbable, second]) == Challenge(1, improbable=False)
    assert next_challenge([improbable, second], frozenset({"mass_error"})) == Challenge(0, improbable=True)
    assert next_challenge([LAG, second], frozenset({"mass_error"})) is None


def test_of_two_with_likelier_alternatives_the_first_is_challenged() -> None:
    causes = [replace(each, share=0.4, alternative_share=0.6) for each in (LAG, MASS)]
    assert next_challenge(causes) == Challenge(0, improbable=False)
    assert next_challenge(causes, frozenset({"actuator_lag"})) == Challenge(1, improbable=False)


@pytest.mark.parametrize(("change", "challenged"), [(-1e-9, False), (0.0, False), (1e-9, True)])
def test_a_tie_with_an_alternative_is_no_challenge(change: float, challenged: bool) -> None:
    cause = replace(LAG, share=0.5, alternative_share=0.5 + change)
    assert next_challenge([cause]) == (Challenge(0, improbable=False) if challenged else None)


@pytest.mark.parametrize(("change", "challenged"), [(-1e-9, True), (0.0, False), (1e-9, False)])
def test_boundary_of_the_probability(change: float, challenged: bool) -> None:
    cause = replace(LAG, probability=LIKELY + change)
    assert next_challenge([cause]) == (Challenge(0, improbable=True) if challenged else None)


@pytest.mark.parametrize(("probabilities", "index"), [((0.3, 0.2), 1), ((0.2, 0.3), 0), ((0.2, 0.2), 0)])
def test_the_improbable_cause_with_the_least_support_is_challenged(
    probabilities: tuple[float, float], index: int
) -> None:
    """In a tie the first."""
    causes = [replace(LAG, probability=p, by_support=p) for p in probabilities]
    assert next_challenge(causes) == Challenge(index, improbable=True)


def test_a_supported_cause_whose_equation_looks_wrong_waits_until_unsupported_ones_are_gone() -> None:
    """One of these may be what makes it look wrong; a probable cause is not challenged at all."""
    refuted, weak = replace(LAG, probability=0.0, by_support=0.99), replace(MASS, probability=0.4, by_support=0.4)
    assert next_challenge([refuted, weak]) == Challenge(1, improbable=True)
    assert next_challenge([refuted]) == next_challenge([refuted, MASS]) == Challenge(0, improbable=True)


def test_an_improbable_cause_is_challenged_however_often() -> None:
    """It cannot come back: it is listed as rejected, and barred."""
    improbable = replace(LAG, probability=0.1)
    assert next_challenge([improbable], frozenset({"actuator_lag"})) == Challenge(0, improbable=True)


@dataclass(frozen=True)
class Successor:
    """The scores of one possible successor as plain values."""

    label: str
    share: float
    score: float
    comparison: ComparisonScores
    probability: float


def candidate(label: str, share: float, score: float, probability: float = 0.9) -> Successor:
    return Successor(label, share, score, ACCEPTED, probability)


def test_the_successor_has_the_largest_share_then_predicts_best() -> None:
    first, second, third = candidate("a", 0.2, -10.0), candidate("b", 0.3, -20.0), candidate("c", 0.3, -15.0)
    assert successor([first, second, third]) == 2
    assert successor([first, second, third], frozenset({"c"})) == 1
    assert successor([first, second, third], frozenset({"c", "b"})) == 0
    assert successor([first, second, third], frozenset({"a", "b", "c"})) is None


def test_in_a_tie_the_first_succeeds() -> None:
    assert successor([candidate("a", 0.3, -10.0), candidate("b", 0.3, -10.0)]) == 0


def test_a_successor_is_accepted_and_probable() -> None:
    rejected = replace(candidate("a", 0.9, -10.0), comparison=replace(ACCEPTED, log_bayes_factor=0.0))
    improbable = candidate("b", 0.8, -10.0, probability=0.49)
    assert successor([rejected, improbable]) is None
    assert successor([rejected, improbable, candidate("c", 0.0, -99.0)]) == 2


@pytest.mark.parametrize(("change", "found"), [(-1e-9, None), (0.0, 0), (1e-9, 0)])
def test_boundary_of_the_successors_probability(change: float, found: int | None) -> None:
    assert successor([candidate("a", 0.5, 0.0, LIKELY + change)]) == found


def test_what_neither_kind_of_evidence_excludes_is_not_excluded() -> None:
    """Two explanations: by prediction 1000 to 1, by the commands even: even. And the other way round."""
    by_commands = combined_shares(np.array([1000.0, 1.0]) / 1001.0, 1, np.array([0.0]))
    np.testing.assert_allclose(by_commands, [0.5, 0.5])
    by_prediction = combined_shares(np.array([0.5, 0.5]), 1, np.array([np.log(1000.0)]))
    np.testing.assert_allclose(by_prediction, [0.5, 0.5])


def test_what_both_kinds_exclude_is_excluded() -> None:
    shares = combined_shares(np.array([1000.0, 1.0]) / 1001.0, 1, np.array([np.log(1000.0)]))
    np.testing.assert_allclose(shares, np.array([1000.0, 1.0]) / 1001.0)


def test_an_alternative_that_both_kinds_prefer_has_the_larger_share() -> None:
    """By 100 to 1 either way."""
    shares = combined_shares(np.array([1.0, 100.0]) / 101.0, 1, np.array([-np.log(100.0)]))
    np.testing.assert_allclose(shares, np.array([1.0, 100.0]) / 101.0)


def test_a_cause_alone_has_all_of_it() -> None:
    np.testing.assert_allclose(combined_shares(np.array([1.0]), 1, np.empty(0)), [1.0])


@given(
    st.lists(st.floats(1e-6, 1.0), min_size=2, max_size=8),
    st.lists(st.floats(-300.0, 300.0), min_size=8, max_size=8),
    st.integers(1, 7),
)
def test_combined_shares_are_probabilities(weights: list[float], leads: list[float], sets: int) -> None:
    predictive = np.array(weights) / sum(weights)
    sets = min(sets, predictive.size - 1)
    shares = combined_shares(predictive, sets, np.array(leads[: predictive.size - sets]))
    assert (shares >= 0.0).all() and shares.sum() == pytest.approx(1.0)


def test_shares_add_up_by_effect() -> None:
    """Two sets hold the cause; an effect in two shapes counts once; doing without is no alternative."""
    shares = np.array([0.3, 0.2, 0.1, 0.15, 0.2, 0.05])
    share, alternatives = shares_by_effect("actuator_lag", ["cg_shift", "mass_error", "cg_shift"], shares, np.ones(6))
    assert share == pytest.approx(0.5)
    assert [effect for effect, _ in alternatives] == ["cg_shift", "mass_error"]
    np.testing.assert_allclose([p for _, p in alternatives], [0.3, 0.15])


def test_another_shape_of_the_same_effect_is_the_same_cause() -> None:
    share, alternatives = shares_by_effect("stuck_surface", ["stuck_surface"], np.array([0.5, 0.3, 0.2]), np.ones(3))
    assert share == pytest.approx(0.8) and alternatives == ()


def test_prior_odds_weigh_shares() -> None:
    share, ((_, other),) = shares_by_effect("a", ["b"], np.array([0.5, 0.5, 0.0]), np.array([1.0, 0.25, 1.0]))
    assert (share, other) == (pytest.approx(0.8), pytest.approx(0.2))


def test_what_is_least_probable_together_is_left_out_first() -> None:
    """Truth: the products by hand, 0.3, 0.1, 0.03 (both), 0.001 and so on."""
    assert kept_causes([0.999, 0.9, 0.7]) == [(0, 1), (0, 2), (0,), (1, 2), (1,), (2,)]
    assert kept_causes([0.6, 0.8]) == [(1,), (0,)]
    assert kept_causes([1.0, 1.0, 0.5]) == [(0, 1), (0, 2), (1, 2), (0,), (1,), (2,)]  # ties: the larger ones first
    assert kept_causes([0.9]) == kept_causes([]) == []
