"""Which candidates are accepted, from tables of scores made by hand; truth: each rule, at its boundary."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.residuals.residual_model import CHANNELS, COEFFICIENTS
from sysid_node.gap.selection.acceptance import (
    AddedSize,
    ChannelScores,
    ComparisonTable,
    DerivativeShift,
    ReadingScores,
    RemainingPower,
    RemainingStructure,
    ScoresInGusts,
    channels_improved,
    is_accepted,
    is_plausible,
    is_relevant,
    nats_by_tolerances,
    rejection,
)
from sysid_node.gap.thresholds import THRESHOLDS

LIMITS = THRESHOLDS.acceptance
NOTHING = RemainingPower(np.zeros(12), np.zeros(12))
V = CHANNELS.index("V")
LOG_ODDS = LIMITS.log_bayes_factor(30)


def channels(value: float, rest: float = 0.0, channel: int = 0) -> np.ndarray:
    """One of twelve channels at a value, the others at another."""
    found = np.full(12, rest)
    found[channel] = value
    return found


def removed(without: float, with_it: float, channel: int = 0) -> RemainingPower:
    """Power of one channel, the others at zero."""
    return RemainingPower(channels(without, channel=channel), channels(with_it, channel=channel))


def reading(without: float, with_it: float) -> RemainingPower:
    """Mean squares of the error of one reading of eleven, the others at zero."""
    return RemainingPower(channels(without)[:11], channels(with_it)[:11])


def shifted(without: float, with_it: float) -> tuple[DerivativeShift, DerivativeShift]:
    """Ten derivatives that the flight determines: their squared distance from the file without and with a cause."""
    return DerivativeShift(without, 10.0), DerivativeShift(with_it, 10.0)


def test_one_common_cause_is_more_probable_than_many_draws() -> None:
    """Truth: of ten derivatives two sigma off each the joint prior is exp(-20), of ten at the file's values one."""
    assert nats_by_tolerances(shifted(40.0, 0.0)) == pytest.approx(20.0)
    assert nats_by_tolerances(shifted(40.0, 10.0 + LIMITS.joint * np.sqrt(20.0))) == 0.0  # as improbable with it


def test_one_gross_error_is_weighed_by_the_same_joint_prior() -> None:
    """Truth: one of ten derivatives six sigma off; its prior made five times as wide, with one choice among three."""
    widening = float(np.log(5.0) + np.log(3.0))
    gross = (DerivativeShift(36.0, 10.0), DerivativeShift(36.0 / 25.0, 10.0, widening))
    assert nats_by_tolerances(gross) == pytest.approx(18.0 * 24.0 / 25.0 - widening)


def added(**changes: float) -> AddedSize:
    """No time, and of no size that matters, with changes."""
    return replace(AddedSize(time=None, sample_period=0.01), **changes)


def powers(**changes: object) -> ChannelScores:
    """90 % of what is left of CL is removed, a tenth of the motion's power; with changes."""
    improved = ChannelScores(motion=np.ones(12), power=removed(0.1, 0.01), contribution=channels(0.5))
    return replace(improved, **changes)


LITTLE = powers(power=removed(0.1, 0.09))


def hidden(power: RemainingPower) -> ChannelScores:
    """The power of one flight, where another holds so much more that its own is hardly seen in the sum."""
    return powers(power=removed(9.03, 9.0), by_flight=((np.ones(12), power),))


def in_gusts(structure: RemainingStructure | None = None, mean_power: RemainingPower = NOTHING) -> ScoresInGusts:
    """What is structure, and what is off on average: nothing."""
    return ScoresInGusts(structure or RemainingStructure(NOTHING, np.zeros(12)), mean_power)


def readings(without: float, with_it: float, motion: float = 1.0) -> ReadingScores:
    """Of one reading, the others without error."""
    return ReadingScores(reading(without, with_it), np.full(11, motion), np.zeros(11))


def table(**changes: object) -> ComparisonTable:
    """A candidate that is accepted, with changes."""
    scores = ComparisonTable(added(), probability=0.99, channels=powers(), log_bayes_factor=50.0, searched=30)
    return replace(scores, **changes)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, None),
        ({"added": added(time=0.005)}, "within one sample"),
        ({"added": added(time=-0.005)}, "within one sample"),
        ({"added": added(time=0.1)}, None),
        ({"added": added(gradual=True)}, "no stall"),
        ({"probability": 0.5}, "predict better"),
        ({"channels": LITTLE}, "too little"),
        ({"channels": powers(contribution=np.zeros(12))}, "too little"),
        ({"channels": powers(contribution=channels(0.5, channel=1))}, "too little"),  # not on the one that it improves
        ({"channels": powers(contribution=np.full(12, np.inf))}, None),  # without it nothing finite is predicted
        ({"added": added(play=0.96)}, "stuck"),
        ({"added": added(play=0.94)}, None),
        ({"added": added(largest=LIMITS.plausible + 1e-9)}, "so far"),
        ({"added": added(largest=LIMITS.plausible)}, None),
        ({"channels": LITTLE, "shifts": shifted(40.0, 10.0)}, None),  # fifteen nats by the joint prior
        ({"channels": LITTLE, "shifts": shifted(10.0 + 2.0 * LOG_ODDS, 10.0)}, "too little"),
        ({"channels": LITTLE, "shifts": shifted(90.0, 60.0)}, "too little"),  # nor plausible with it
        ({"channels": LITTLE, "readings": readings(0.01, 0.007)}, None),
        ({"channels": LITTLE, "readings": readings(0.01, 0.008)}, "too little"),
        ({"channels": LITTLE, "readings": readings(0.003, 0.0)}, None),
        ({"channels": LITTLE, "readings": readings(0.0025, 0.0)}, "too little"),
        ({"channels": LITTLE, "readings": readings(9.0, 0.0, np.inf)}, "too little"),  # of a reading not compared
        ({"channels": LITTLE, "added": added(bias=LIMITS.bias + 1e-9)}, None),  # more than the file states of it
        ({"channels": LITTLE, "added": added(bias=LIMITS.bias)}, "too little"),
        ({"channels": hidden(removed(0.1, 0.01))}, None),
        ({"channels": hidden(removed(0.1, 0.09))}, "too little"),
        ({"probability": 0.5, "added": added(bias=LIMITS.bias + 1e-9)}, None),  # derivatives can be bent to a bias
        ({"probability": 0.49, "added": added(bias=LIMITS.bias + 1e-9)}, "predict better"),
        ({"log_bayes_factor": 0.0}, "commands"),
        ({"log_bayes_factor": np.nan}, "commands"),
    ],
)
def test_each_rule(changes: dict[str, object], reason: str | None) -> None:
    found = rejection(table(**changes))
    assert found is None if reason is None else reason in str(found)
    assert is_accepted(table(**changes)) is (reason is None)


@pytest.mark.parametrize(("by_clock", "relevant"), [(0.0, False), (0.004, False), (0.006, True)])
def test_a_lag_is_an_alternative_by_the_delay_that_it_and_the_clock_make_together(
    by_clock: float, relevant: bool
) -> None:
    """A lag of 5 ms beside a clock that is off by so much, where a sample takes 10 ms: it is never a cause itself."""
    scores = table(added=added(time=0.005, by_clock=by_clock))
    assert is_relevant(scores) is relevant
    assert not is_accepted(scores)


@pytest.mark.parametrize(
    ("changes", "plausible"),
    [
        ({"time": 0.005}, False),
        ({"time": 0.005, "by_clock": 0.006}, True),
        ({"gradual": True}, False),
        ({"largest": LIMITS.plausible + 1e-9}, False),
        ({"largest": LIMITS.plausible}, True),
    ],
)
def test_a_size_is_plausible_or_not_whatever_else_the_cause_does(changes: dict[str, object], plausible: bool) -> None:
    for channels in (table().channels, LITTLE):
        assert is_plausible(table(added=added(**changes), channels=channels)) is plausible


@pytest.mark.parametrize(("time", "accepted"), [(0.01 - 1e-9, False), (0.01, True), (0.01 + 1e-9, True)])
def test_boundary_of_one_sample(time: float, accepted: bool) -> None:
    assert is_accepted(table(added=added(time=time))) is accepted
    assert is_accepted(table(added=added(time=-time))) is accepted


@pytest.mark.parametrize(("change", "accepted"), [(-1e-9, False), (0.0, False), (1e-9, True)])
def test_a_probability_at_the_threshold_is_not_beyond_doubt(change: float, accepted: bool) -> None:
    assert is_accepted(table(probability=LIMITS.probability + change)) is accepted


@pytest.mark.parametrize(("change", "accepted"), [(-1e-9, False), (0.0, False), (1e-9, True)])
def test_boundary_of_the_share_that_comes_back(change: float, accepted: bool) -> None:
    assert is_accepted(table(channels=powers(contribution=channels(LIMITS.share_of_gap + change)))) is accepted


@pytest.mark.parametrize(("change", "accepted"), [(-1e-9, False), (0.0, False), (1e-9, True)])
def test_boundary_of_the_log_bayes_factor(change: float, accepted: bool) -> None:
    assert is_accepted(table(log_bayes_factor=LOG_ODDS + change)) is accepted


def test_picked_from_more_effects_a_candidate_needs_more_support() -> None:
    scores = table(log_bayes_factor=LOG_ODDS + 0.1)
    assert is_accepted(scores) and not is_accepted(replace(scores, searched=60))


@pytest.mark.parametrize(("change", "improved"), [(-1e-9, False), (1e-9, True)])
def test_boundary_of_the_share_of_the_remainder(change: float, improved: bool) -> None:
    """A quarter of 0.1 of the motion."""
    power = removed(0.1, 0.1 * (1.0 - LIMITS.share_of_remainder) - change)
    assert bool(channels_improved(powers(power=power))[0]) is improved


@pytest.mark.parametrize(("change", "improved"), [(-1e-9, False), (1e-9, True)])
def test_boundary_of_a_noticeable_error(change: float, improved: bool) -> None:
    """All that is left of a channel is removed: it matters from 5 % of the motion (rms)."""
    power = removed(LIMITS.noticeable_error**2 + change, 0.0)
    assert bool(channels_improved(powers(power=power))[0]) is improved


@pytest.mark.parametrize(("change", "improved"), [(-1e-9, False), (1e-9, True)])
def test_a_large_error_counts_whatever_share_of_the_remainder_it_is(change: float, improved: bool) -> None:
    power = removed(1.0, 1.0 - LIMITS.large_error**2 - change)
    assert bool(channels_improved(powers(power=power))[0]) is improved


def test_powers_count_as_shares_of_the_motion() -> None:
    assert not is_accepted(table(channels=powers(motion=np.full(12, 100.0))))


def structure(without: float, with_it: float) -> RemainingStructure:
    """Of CL, in noise levels; of 100 of all power."""
    return RemainingStructure(removed(without, with_it), channels(100.0, 1.0))


@pytest.mark.parametrize(
    ("found", "improved"),
    [
        (structure(40.0, 10.0), True),  # 30 % of the power, which is a tenth of the motion's: 3 %
        (structure(40.0, 31.0), False),  # less than a quarter of the structure
        (structure(2.0, 0.0), False),  # 0.2 % of the motion: not noticeable
        (structure(2.6, 0.0), True),
    ],
)
def test_in_gusts_what_is_structure_of_forces_counts(found: RemainingStructure, improved: bool) -> None:
    """Of the power, hardly any is removed: the rest is weather."""
    scores = replace(LITTLE, in_gusts=in_gusts(found))
    assert bool(channels_improved(scores)[0]) is improved
    assert not channels_improved(replace(scores, in_gusts=None))[0]


@pytest.mark.parametrize(
    ("means", "improved"), [((0.1, 0.01), True), ((0.1, 0.08), False), ((0.0024, 0.0), False), ((0.0026, 0.0), True)]
)
def test_in_gusts_what_is_off_on_average_counts(means: tuple[float, float], improved: bool) -> None:
    scores = powers(power=removed(0.1, 0.1), in_gusts=in_gusts(mean_power=removed(*means)))
    assert bool(channels_improved(scores)[0]) is improved


def test_in_gusts_a_reading_counts_by_its_power() -> None:
    """Air data and attitude are predicted from the inertial instruments, in which gusts are."""
    assert len(COEFFICIENTS) <= V
    scores = powers(power=removed(0.1, 0.01, V), contribution=channels(0.5, channel=V), in_gusts=in_gusts())
    assert is_accepted(table(channels=scores))
    assert not channels_improved(replace(scores, power=removed(0.1, 0.01)))[0]  # a force's power does not count


def test_other_thresholds_decide_otherwise() -> None:
    strict = replace(THRESHOLDS, acceptance=replace(LIMITS, probability=0.999))
    assert is_accepted(table()) and not is_accepted(table(), strict)
