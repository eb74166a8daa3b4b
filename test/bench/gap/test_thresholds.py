"""Decisions made again from recorded scores; truth: tables made by hand, and causes whose truth is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.gap import score_tables
from bench.gap.score_tables import CandidateScores, RecordedDiagnosis, WeighedCause
from bench.gap.thresholds import changed, named, page, sweeps
from sysid_node.gap.selection.acceptance import (
    AddedSize,
    ChannelScores,
    ComparisonTable,
    RemainingPower,
    RemainingStructure,
    ScoresInGusts,
)
from sysid_node.gap.selection.calibration import CauseEvidence
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.gap.verdict.decision import CauseScores, RejectedCauseScores, VerdictScores

NOTHING = RemainingPower(np.zeros(12), np.zeros(12))
COMPARISON = ComparisonTable(
    AddedSize(time=0.1, sample_period=0.01), probability=0.97,
    channels=ChannelScores(
        np.ones(12), RemainingPower(np.full(12, 0.1), np.zeros(12)), contribution=np.ones(12),
        in_gusts=ScoresInGusts(RemainingStructure(NOTHING, np.zeros(12)), NOTHING),
    ),
    log_bayes_factor=50.0, searched=30,
)  # fmt: skip
LAG = WeighedCause(
    "actuator_lag", True, 0.85, 0.15, CauseEvidence(100.0, 0.0, False), COMPARISON, -500.0,
    (CandidateScores("command_delay", COMPARISON, -20.0),),
)  # fmt: skip
SCALE = replace(LAG, label="imu_scale", kept=False, evidence=CauseEvidence(100.0, 0.35, False), comparison=None)


@pytest.fixture
def known() -> RecordedDiagnosis:
    """A lag told apart from a delay, beside a misspecified effect that was replaced."""
    scores = VerdictScores(
        signal_to_noise=1000.0, weather_suffices=False, externally_excited=True,
        causes=(CauseScores("actuator_lag", 0.85, np.full(12, 0.5)),),
        rejected=(RejectedCauseScores("imu_scale", supported_but_misspecified=True, replaced=True),),
        score_before=-500.0, score_after=-400.0, motion=np.ones(12), power_before=np.full(12, 0.6),
        power_after=np.full(12, 0.01), structure_deviations=np.zeros(12), structure_share=np.zeros(12),
        sampling=np.zeros(12), simulation=None,
    )  # fmt: skip
    return RecordedDiagnosis("a flight", scores, (LAG, SCALE), (CandidateScores("actuator_lag", COMPARISON),))


def test_scores_are_read_as_they_were_written(known, tmp_path: Path) -> None:
    score_tables.write(tmp_path / "tables.json", [known, known])
    again, _ = score_tables.read(tmp_path / "tables.json")
    assert again.verdict(THRESHOLDS) == known.verdict(THRESHOLDS) == "explained"
    assert again.selection(THRESHOLDS) == known.selection(THRESHOLDS)
    assert again.causes[0].evidence == LAG.evidence
    powers = again.first_stage[0].comparison.channels.power
    np.testing.assert_array_equal(powers.without, COMPARISON.channels.power.without)


def test_a_stricter_threshold_changes_the_verdict(known) -> None:
    strict = replace(THRESHOLDS, verdict=replace(THRESHOLDS.verdict, told_apart=0.9))
    changes, searches = changed([known], strict)
    assert changes == {("explained", "ambiguous"): 1} and searches == 0


def test_a_stricter_acceptance_changes_the_search(known) -> None:
    strict = replace(THRESHOLDS, acceptance=replace(THRESHOLDS.acceptance, probability=0.98))
    changes, searches = changed([known], strict)
    assert not changes and searches == 1


def test_an_effect_that_is_no_longer_misspecified_would_be_kept(known) -> None:
    lenient = replace(THRESHOLDS, calibration=replace(THRESHOLDS.calibration, misspecification=0.4))
    assert changed([known], lenient) == ({}, 1)


def test_each_threshold_is_swept_alone() -> None:
    for name, value, thresholds in sweeps(["verdict"]):
        group, _, entry = name.partition(".")
        assert getattr(getattr(thresholds, group), entry) == value
        assert replace(thresholds, verdict=THRESHOLDS.verdict) == THRESHOLDS
        assert name != "verdict.told_apart" or value < 1.0


def test_the_page_lists_what_changes(known) -> None:
    text = page([known], [(LAG.evidence, True), (SCALE.evidence, False)], ["verdict", "calibration"])
    assert "| calibration.misspecification | 0.375 | 0 | - | 1 |" in text
    assert "verdict.told_apart" in text.partition("No change")[2]  # 0.85 is told apart by 0.4 and 0.64, too
    assert "2 causes of known truth" in text


def test_causes_of_known_truth_are_counted() -> None:
    causes = [(CauseEvidence(1e4, 0.0, False), True), (CauseEvidence(1e4, 0.0, False), False)]
    causes += [(CauseEvidence(2.0, 0.0, False), True), (CauseEvidence(1e4, 0.9, False), False)]
    assert named(causes, THRESHOLDS) == (1, 1, 1)
