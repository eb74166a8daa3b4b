"""What is said of the remainder of a gap, from tables of scores made by hand; truth: the rules of the verdict."""

from dataclasses import replace

import numpy as np

from sysid_node.gap.verdict.decision import (
    CauseScores,
    RejectedCauseScores,
    SimulationScores,
    VerdictScores,
    decide,
)
from sysid_node.report.sections.gap.remainder import what_remains
from sysid_node.report.wording.causes import percent

CLOSED = SimulationScores(after=0.05, noise_floor=0.05, after_lower=0.04, noise_floor_upper=0.06, shrink_upper=100.0)
SCORES = VerdictScores(
    signal_to_noise=1000.0, weather_suffices=False, externally_excited=True,
    causes=(CauseScores("actuator_lag", share=0.95, power_removed=np.full(12, 0.05)),), rejected=(),
    score_before=-500.0, score_after=-400.0, motion=np.ones(12), power_before=np.full(12, 0.06),
    power_after=np.full(12, 0.01), structure_deviations=np.zeros(12), structure_share=np.zeros(12),
    sampling=np.zeros(12), simulation=CLOSED,
)  # fmt: skip


def said_of(scores: VerdictScores) -> str:
    decided = decide(scores)
    assert decided.verdict == "unknown_effect"
    return what_remains(decided, scores)


def test_a_gap_that_stays_open_is_said_to_be_large() -> None:
    still_open = replace(CLOSED, after=0.3, after_lower=0.25, shrink_upper=70.0)
    assert said_of(replace(SCORES, simulation=still_open)).startswith("A large part remains")


def test_a_gap_that_is_closed_leaves_no_large_part_but_what_is_left_by_frequency() -> None:
    """Short flights show nothing more; a tenth of the pitching moment's power, 31 % of its motion, is structure."""
    one = np.eye(12)[4]  # Cm
    left = {"structure_deviations": 10.0 * one, "structure_share": 0.9 * one, "power_after": 0.01 + 0.1 * one}
    assert said_of(replace(SCORES, **left)).endswith(f"predicts: {percent(0.31)} of the pitching moment.")


def test_remainders_that_are_small_by_channel_are_named_when_they_are_much_together() -> None:
    """None of them is large enough to matter alone: the causes remove a hundredth of all that is not noise."""
    left = {"structure_deviations": np.full(12, 10.0), "structure_share": np.full(12, 0.9)}
    powers = {"power_before": np.full(12, 0.0021), "power_after": np.full(12, 0.002)}
    causes = (replace(SCORES.causes[0], power_removed=np.full(12, 1e-4)),)
    said = said_of(replace(SCORES, causes=causes, **left, **powers))
    assert said.count("% of the") == 3


def test_an_effect_that_resembles_a_known_one_is_named() -> None:
    resembling = RejectedCauseScores("imu_scale", supported_but_misspecified=True)
    assert "resembles imu scale" in said_of(replace(SCORES, rejected=(resembling,)))


def test_causes_that_predict_no_better_are_said_to() -> None:
    assert "predict forces and moments as well" in said_of(replace(SCORES, score_after=-501.0))
