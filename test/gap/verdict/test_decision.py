"""The verdict from tables of scores made by hand; truth: the rules of docs/explanation/gap.md, at every boundary."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.gap.verdict.decision import (
    CauseScores,
    RejectedCauseScores,
    SimulationScores,
    VerdictScores,
    closes_too_little,
    decide,
    error_needs_cause,
    explained_share,
    structure_exceeds_causes,
    structure_left,
    structured_channels,
    unexplained_share,
)

#: Errors of short flights at the noise floor, all of the gap closed.
CLOSED = SimulationScores(after=0.05, noise_floor=0.05, after_lower=0.04, noise_floor_upper=0.06, shrink_upper=100.0)

#: Much of the gap surely left open.
OPEN = replace(CLOSED, after=0.3, after_lower=0.25, shrink_upper=70.0)

LAG = CauseScores("actuator_lag", share=0.95, power_removed=np.full(12, 0.5))
MISSPECIFIED = RejectedCauseScores("imu_scale", supported_but_misspecified=True)


def channels(value: float, rest: float = 0.0) -> np.ndarray:
    """Of twelve channels the first at a value, the rest at another."""
    return np.concatenate([[value], np.full(11, rest)])


def table(**changes: object) -> VerdictScores:
    """An exciting flight, nothing left but noise; no cause, unless changed."""
    scores = VerdictScores(
        signal_to_noise=1000.0, weather_suffices=False, externally_excited=True, causes=(), rejected=(),
        score_before=-500.0, score_after=-400.0, motion=np.ones(12), power_before=np.full(12, 0.6),
        power_after=np.full(12, 0.01), structure_deviations=np.zeros(12), structure_share=np.zeros(12),
        sampling=np.zeros(12), simulation=CLOSED,
    )  # fmt: skip
    return replace(scores, **changes)


#: On one channel a tenth of the motion's power is left, nearly all of it structure.
STRUCTURED = {
    "structure_deviations": channels(10.0),
    "structure_share": channels(0.9),
    "power_after": channels(0.1, 0.01),
}


@pytest.mark.parametrize(
    ("changes", "verdict", "reason"),
    [
        ({}, "no_gap", "nothing that matters"),
        ({"signal_to_noise": 1.0}, "unsupported", "noise"),
        ({"weather_suffices": True}, "no_gap", "weather"),
        ({"weather_suffices": True, "externally_excited": False}, "no_gap", "weather"),
        ({"weather_suffices": True, "signal_to_noise": 1.0}, "unsupported", "sensors' noise"),
        ({"externally_excited": False}, "unsupported", "autopilot"),
        ({"externally_excited": False, "causes": (LAG,)}, "unsupported", "autopilot"),
        (STRUCTURED, "unknown_effect", "no effect explains it"),
        ({**STRUCTURED, "excited": np.array([0.0, *[1.0] * 11])}, "no_gap", "nothing that matters"),
        ({"rejected": (MISSPECIFIED,)}, "unknown_effect", "misspecified"),
        ({"rejected": (replace(MISSPECIFIED, replaced=True),)}, "no_gap", "nothing that matters"),
        ({"rejected": (replace(MISSPECIFIED, supported_but_misspecified=False),)}, "no_gap", "nothing that matters"),
        ({"simulation": OPEN}, "unknown_effect", "error is larger"),
        ({"simulation": None}, "no_gap", "nothing that matters"),
    ],
)
def test_verdicts_without_causes(changes: dict[str, object], verdict: str, reason: str) -> None:
    decision = decide(table(**changes))
    assert decision.verdict == verdict
    assert reason in decision.reason


@pytest.mark.parametrize(
    ("changes", "verdict", "reason"),
    [
        ({}, "explained", "told apart"),
        ({"simulation": None}, "explained", "told apart"),
        ({"causes": (replace(LAG, share=0.6),)}, "ambiguous", "alternative"),
        ({"causes": (LAG, replace(LAG, share=0.6))}, "ambiguous", "alternative"),
        ({"simulation": OPEN}, "unknown_effect", "close too little"),
        ({"score_after": -600.0}, "unknown_effect", "no better"),
        ({"power_after": np.full(12, 0.6)}, "explained", "told apart"),  # nothing removed, nothing structured left
        ({**STRUCTURED, "power_before": channels(0.11, 0.01)}, "unknown_effect", "too small a share"),
        ({**STRUCTURED, "causes": (replace(LAG, power_removed=channels(0.05)),)}, "unknown_effect", "more structure"),
        (STRUCTURED, "explained", "told apart"),  # the cause removes more on that channel than is left
        ({"rejected": (MISSPECIFIED,)}, "unknown_effect", "misspecified"),
        ({"rejected": (replace(MISSPECIFIED, replaced=True),)}, "explained", "told apart"),
    ],
)
def test_verdicts_with_causes(changes: dict[str, object], verdict: str, reason: str) -> None:
    decision = decide(table(**{"causes": (LAG,), **changes}))
    assert decision.verdict == verdict
    assert reason in decision.reason


def test_a_decision_names_causes_and_doubted_effects() -> None:
    decision = decide(table(causes=(LAG, replace(LAG, label="cg_shift")), rejected=(MISSPECIFIED,)))
    assert decision.causes == ("actuator_lag", "cg_shift")
    assert decision.rejected == ("imu_scale",)


@pytest.mark.parametrize(("change", "verdict"), [(-1e-9, "unsupported"), (0.0, "no_gap"), (1e-9, "no_gap")])
def test_boundary_of_the_excitation(change: float, verdict: str) -> None:
    """A flight exactly at the threshold is diagnosed."""
    assert decide(table(signal_to_noise=THRESHOLDS.admission.excitation + change)).verdict == verdict


@pytest.mark.parametrize(("change", "verdict"), [(-1e-9, "ambiguous"), (0.0, "explained"), (1e-9, "explained")])
def test_boundary_of_causes_told_apart(change: float, verdict: str) -> None:
    cause = replace(LAG, share=THRESHOLDS.verdict.told_apart + change)
    assert decide(table(causes=(cause,))).verdict == verdict


@pytest.mark.parametrize(
    ("change", "verdict"), [(-1e-9, "unknown_effect"), (0.0, "unknown_effect"), (1e-9, "explained")]
)
def test_a_tie_of_predictions_does_not_explain(change: float, verdict: str) -> None:
    assert decide(table(causes=(LAG,), score_before=-10.0, score_after=-10.0 + change)).verdict == verdict


@pytest.mark.parametrize(("change", "verdict"), [(-1e-6, "unknown_effect"), (0.0, "explained"), (1e-6, "explained")])
def test_boundary_of_the_share_that_is_explained(change: float, verdict: str) -> None:
    """One channel: 0.25 of the motion is structure that is left, 4 times as much is removed."""
    removed = 1.0 + change
    scores = table(
        causes=(replace(LAG, power_removed=channels(2.0)),), power_before=channels(0.25 + removed),
        power_after=channels(0.25), structure_deviations=channels(10.0), structure_share=channels(1.0),
    )  # fmt: skip
    assert explained_share(scores) == pytest.approx(removed / (removed + 0.25))
    assert decide(scores).verdict == verdict


@pytest.mark.parametrize(("change", "structured"), [(-1e-9, False), (0.0, False), (1e-9, True)])
def test_boundary_of_the_deviations_of_structure(change: float, structured: bool) -> None:
    scores = table(**{**STRUCTURED, "structure_deviations": channels(THRESHOLDS.verdict.structure + change)})
    assert structured_channels(scores).tolist() == [structured] + [False] * 11


@pytest.mark.parametrize("sampling", [0.0, 0.01])
@pytest.mark.parametrize(("change", "structured"), [(-1e-9, False), (1e-9, True)])
def test_boundary_of_the_size_of_structure(sampling: float, change: float, structured: bool) -> None:
    """Its power must exceed the noticeable error's and what sampling leaves."""
    power = THRESHOLDS.acceptance.noticeable_error**2 + sampling + change
    scores = table(
        structure_deviations=channels(10.0), structure_share=np.ones(12), power_after=channels(power),
        sampling=np.full(12, sampling),
    )  # fmt: skip
    assert structured_channels(scores)[0] == structured
    assert decide(scores).verdict == ("unknown_effect" if structured else "no_gap")


@pytest.mark.parametrize(("change", "left"), [(0.0, 0.0), (1e-9, 0.09)])
def test_coherence_within_chance_is_no_structure(change: float, left: float) -> None:
    scores = table(**{**STRUCTURED, "structure_deviations": channels(THRESHOLDS.instruments.chance + change)})
    assert structure_left(scores)[0] == pytest.approx(left)


@pytest.mark.parametrize(("removed", "exceeds"), [(0.0899, True), (0.0901, False)])
def test_causes_must_remove_more_on_a_channel_than_is_left_there(removed: float, exceeds: bool) -> None:
    """Two causes together; 0.09 of the motion is structure that is left."""
    half = replace(LAG, power_removed=channels(0.5 * removed))
    assert structure_exceeds_causes(table(**STRUCTURED, causes=(half, half))) is exceeds


def test_powers_count_as_shares_of_the_motion() -> None:
    scores = table(**STRUCTURED, causes=(LAG,))
    larger = replace(
        scores, motion=7.0 * scores.motion, power_before=7.0 * scores.power_before, power_after=7.0 * scores.power_after
    )
    np.testing.assert_allclose(structure_left(larger), structure_left(scores))
    assert explained_share(larger) == pytest.approx(explained_share(scores))


@pytest.mark.parametrize(("after", "needs"), [((0.15, 0.18), True), ((0.09, 0.12), False)])
def test_an_error_of_a_tenth_of_the_motion_beyond_the_noise_needs_a_cause(
    after: tuple[float, float], needs: bool
) -> None:
    """0.15 less a floor of at most 0.08 leaves 0.13; 0.09 leaves 0.04. However much of the gap is closed."""
    simulation = SimulationScores(0.16, 0.066, after[0], 0.08, 97.0)
    assert error_needs_cause(simulation) is needs


@pytest.mark.parametrize(("change", "needs"), [(-1e-9, False), (1e-9, True)])
def test_boundary_of_the_error_beyond_the_noise(change: float, needs: bool) -> None:
    lower = np.hypot(0.08, THRESHOLDS.verdict.error) + change
    assert error_needs_cause(SimulationScores(0.2, 0.18, float(lower), 0.08, 97.0)) is needs


@pytest.mark.parametrize(
    ("after", "upper", "little"),
    [
        (0.2, 89.9, True),
        (0.2, 90.0, False),  # it may be all that is wanted
        (0.15, 80.0, False),  # chance leaves as much above a floor of 0.1
        (0.1501, 80.0, True),
    ],
)
def test_boundaries_of_what_is_closed(after: float, upper: float, little: bool) -> None:
    simulation = SimulationScores(after, 0.1, after, 0.1, upper)
    assert closes_too_little(simulation) is little
    assert not closes_too_little(None)


def test_the_unexplained_share_is_zero_where_nothing_is_structured() -> None:
    assert unexplained_share(table()) == 0.0
    structured = table(**STRUCTURED)
    assert unexplained_share(structured) == pytest.approx(1.0 - explained_share(structured)) != 0.0
    assert unexplained_share(table(rejected=(MISSPECIFIED,), power_before=np.zeros(12))) == 0.0  # all of nothing


def test_other_thresholds_give_other_verdicts() -> None:
    lenient = replace(THRESHOLDS, verdict=replace(THRESHOLDS.verdict, told_apart=0.5))
    scores = table(causes=(replace(LAG, share=0.6),))
    assert (decide(scores).verdict, decide(scores, lenient).verdict) == ("ambiguous", "explained")
