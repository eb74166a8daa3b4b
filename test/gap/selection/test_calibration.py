"""The calibrated probability of a cause; truth: the regression by hand, and each rule at its boundary."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid_node.gap.selection.calibration import (
    CauseEvidence,
    calibrated_probability,
    evidence_of,
    imitation,
    is_misspecified,
    is_supported_but_misspecified,
    misspecification_of,
    prior_odds,
    regressors,
)
from sysid_node.gap.selection.misspecification import Misspecification
from sysid_node.gap.thresholds import THRESHOLDS

LIMITS = THRESHOLDS.calibration
NATS, MISFITS = st.floats(-1e3, 1e6), st.floats(0.0, 2.0)


def evidence(nats: float, misspecification: float = 0.0, flexible: bool = False) -> CauseEvidence:
    return CauseEvidence(nats, misspecification, flexible)


@given(NATS, st.floats(0.0, 1e5), MISFITS)
def test_more_support_is_more_probable(nats: float, more: float, misspecification: float) -> None:
    assert calibrated_probability(evidence(nats, misspecification)) <= calibrated_probability(
        evidence(nats + more, misspecification)
    )


@given(NATS, MISFITS, st.floats(0.0, 1.0))
def test_misfit_counts_against_a_cause(nats: float, misspecification: float, more: float) -> None:
    assert calibrated_probability(evidence(nats, misspecification + more)) <= calibrated_probability(
        evidence(nats, misspecification)
    )


@given(NATS)
def test_a_flexible_effect_is_less_probable(nats: float) -> None:
    assert calibrated_probability(evidence(nats, flexible=True)) < calibrated_probability(evidence(nats))


@given(NATS)
def test_a_misspecified_cause_has_no_probability_however_large_its_support(nats: float) -> None:
    """The evidence for a wrong equation grows with the data."""
    wrong = evidence(nats, 2.0 * LIMITS.misspecification)
    assert calibrated_probability(wrong) == 0.0
    assert is_supported_but_misspecified(wrong) is (calibrated_probability(evidence(nats)) >= LIMITS.probability)
    assert not is_supported_but_misspecified(evidence(nats))


@pytest.mark.parametrize(("change", "misspecified"), [(-1e-9, False), (0.0, False), (1e-9, True)])
def test_boundary_of_the_misfit(change: float, misspecified: bool) -> None:
    assert is_misspecified(evidence(1e4, LIMITS.misspecification + change)) is misspecified


def test_the_probability_is_the_logistic_regressions() -> None:
    """By hand: log odds of -4.02 + 1.18 ln(100) - 1.12."""
    odds = np.exp(-4.02 + 1.18 * np.log(100.0) - 1.12)
    assert calibrated_probability(evidence(100.0, flexible=True)) == pytest.approx(odds / (1.0 + odds))
    assert regressors(evidence(100.0, flexible=True)) == (1.0, pytest.approx(np.log(100.0)), 1.0)
    assert regressors(evidence(-5.0)) == (1.0, 0.0, 0.0)  # no support counts as one nat


def test_the_same_support_by_a_quarter_of_the_flight_says_as_much_as_four_times_by_all_of_it() -> None:
    short = replace(evidence(50.0), windows=0.25 * LIMITS.windows)
    assert calibrated_probability(short) == pytest.approx(calibrated_probability(evidence(200.0)))


def test_no_support_is_not_probable_and_a_large_one_is() -> None:
    assert calibrated_probability(evidence(0.0)) < LIMITS.probability < calibrated_probability(evidence(1e4))


def test_prior_odds_are_lower_for_flexible_effects() -> None:
    assert prior_odds("actuator_lag") == 1.0
    assert prior_odds("mass_error") == pytest.approx(np.exp(LIMITS.flexible))
    assert evidence_of("mass_error", 10.0, misspecification_table(), LIMITS.windows).flexible
    assert not evidence_of("actuator_lag", 10.0, misspecification_table(), LIMITS.windows).flexible


def misspecification_table(contributed: float = 90.0, deviations: float = 10.0) -> Misspecification:
    """The test of an effect on two channels: one as given, one that holds the rest and is fitted exactly."""
    return Misspecification(
        np.array([contributed, 100.0 - contributed]), np.array([10.0, 0.0]), np.array([deviations, 0.0])
    )


def test_misfit_is_the_amplitude_ratio_on_the_channels_where_it_is_significant() -> None:
    assert misspecification_of(misspecification_table()) == pytest.approx(np.sqrt(10.0 / 90.0))


@pytest.mark.parametrize(("change", "counts"), [(-1e-9, False), (0.0, False), (1e-9, True)])
def test_boundary_of_the_deviations_of_a_misfit(change: float, counts: bool) -> None:
    assert (misspecification_of(misspecification_table(deviations=LIMITS.deviations + change)) > 0.0) is counts


@pytest.mark.parametrize(("change", "counts"), [(-1e-6, False), (1e-6, True)])
def test_a_channel_with_little_of_the_effect_does_not_count(change: float, counts: bool) -> None:
    assert (misspecification_of(misspecification_table(contributed=100.0 * LIMITS.counted + change)) > 0.0) is counts


def test_other_thresholds_decide_otherwise() -> None:
    strict = replace(THRESHOLDS, calibration=replace(LIMITS, misspecification=0.1))
    assert calibrated_probability(evidence(1e4, 0.2)) > 0.9
    assert calibrated_probability(evidence(1e4, 0.2), strict) == 0.0


def test_nats_by_tolerances_count_as_they_are_against_what_was_searched() -> None:
    """Truth: the odds e^nats over the number of effects, and those of a flexible effect; no more than the whole."""
    tested = Misspecification(np.zeros(12), np.zeros(12), np.zeros(12))
    found = evidence_of("mass_error", 9.0, tested, LIMITS.windows, by_tolerances=20.0, searched=40)
    assert found.by_tolerances == 9.0
    odds = np.exp(9.0 + LIMITS.flexible) / 40.0
    assert calibrated_probability(found) == pytest.approx(odds / (1.0 + odds))
    assert calibrated_probability(replace(found, by_tolerances=0.0)) < 0.2
    assert evidence_of("mass_error", -3.0, tested, LIMITS.windows, by_tolerances=20.0).by_tolerances == 0.0


def test_an_effect_may_imitate_another_as_far_as_that_is_supported_more() -> None:
    """Truth: odds of e to the difference of the log Bayes factors."""
    assert imitation(7.0, 7.0) == pytest.approx(0.5)
    assert imitation(10.0, 20.0) == pytest.approx(1.0 / (1.0 + np.exp(-10.0)))
    assert (imitation(1e6, 0.0), imitation(0.0, 1e6)) == (0.0, 1.0)
