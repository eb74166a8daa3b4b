"""The causes that are kept, weighed on a flight; truth: the effect that was flown."""

from dataclasses import replace

import numpy as np
import pytest
from gap_flights import stage_of

from sysid_node.gap.selection.calibration import calibrated_probability
from sysid_node.gap.selection.causes import select_causes, variance_by_alternatives
from sysid_node.gap.selection.comparison import power_left
from sysid_node.gap.selection.retention import Challenge, next_challenge


@pytest.fixture(scope="module")
def selected(late):
    """Causes of late commands, where forward selection ended with a lag that resembles them."""
    fitter, base, candidates = late
    lag = fitter.add_candidate(base, candidates["actuator_lag"])
    return select_causes(fitter, base, lag, [stage_of(lag)], [candidates["command_delay"]])


@pytest.mark.slow
def test_the_true_effect_is_the_cause(selected, late) -> None:
    chosen, (cause,), rejected = selected
    assert chosen.fit.effects == {"command_delay"} == {cause.candidate.effect}
    assert rejected == ()
    assert cause.without is late[1]


def test_what_was_doubted_before_does_not_come_back(selected, late) -> None:
    """The search goes on without it: the lag, which the late commands replaced, keeps its place or gives it up."""
    fitter, base, candidates = late
    _, (cause,), _ = selected
    lag = fitter.add_candidate(base, candidates["actuator_lag"])
    chosen, causes, rejected = select_causes(fitter, base, lag, [stage_of(lag)], [candidates["command_delay"]], [cause])
    assert rejected[0] is cause
    assert "command_delay" not in chosen.fit.effects | {each.candidate.effect for each in causes}


def rejected_for_its_equation(fitted):
    """Late commands, as if their equation had been found wrong: well supported, and rejected."""
    fitter, base, candidates = fitted
    commands = fitter.add_candidate(base, candidates["command_delay"])
    _, (cause,), _ = select_causes(fitter, base, commands, [stage_of(commands)], [])
    return replace(cause, evidence=replace(cause.evidence, misspecification=1.0))


@pytest.mark.slow
@pytest.mark.parametrize(("supported", "kept"), [(True, set()), (False, {"inertia_error"})])
def test_a_flexible_effect_is_not_more_probable_because_what_it_imitates_was_rejected(late, supported, kept) -> None:
    """Truth: late commands, which inertias that are off may imitate in a part. What hardly was a cause is none."""
    fitter, base, candidates = late
    cause = rejected_for_its_equation(late)
    if not supported:
        cause = replace(cause, evidence=replace(cause.evidence, log_bayes_factor=0.0, by_tolerances=0.0))
    imitator = fitter.add_candidate(base, candidates["inertia_error"])
    stage = [imitator, fitter.add_candidate(base, candidates["command_delay"])]
    chosen, causes, _ = select_causes(fitter, base, imitator, [stage_of(*stage)], [], [cause])
    assert chosen.fit.effects == {each.candidate.effect for each in causes} == kept


@pytest.mark.slow
def test_what_is_there_besides_is_no_imitation(mistaken) -> None:
    """Truth: late commands, and a centre of gravity that is off. Together they predict best."""
    fitter, base, candidates = mistaken
    shift = fitter.add_candidate(base, candidates["cg_shift"])
    stage = [shift, fitter.add_candidate(base, candidates["command_delay"])]
    _, causes, rejected = select_causes(
        fitter, base, shift, [stage_of(*stage)], [], [rejected_for_its_equation(mistaken)]
    )
    (cause,) = (each for each in (*causes, *rejected) if each.candidate.effect == "cg_shift")
    assert cause.imitation < 1e-6


def test_its_probability_is_its_share_of_the_calibrated_one(selected) -> None:
    _, (cause,), _ = selected
    assert cause.share > 0.95 and cause.share + sum(p for _, p in cause.alternatives) <= 1.0 + 1e-12
    assert cause.probability == pytest.approx(cause.share * calibrated_probability(cause.evidence))
    assert cause.probability > 0.9 and cause.evidence.misspecification < 0.2


def test_a_size_that_is_not_plausible_in_the_whole_explanation_is_no_cause(selected) -> None:
    """Its evidence may be as large as it likes: `retention` then drops it or puts an alternative in its place."""
    _, (cause,), _ = selected
    assert cause.plausible
    absurd = replace(cause, plausible=False)
    assert absurd.probability == absurd.table.probability == 0.0
    assert next_challenge([absurd.table]) == Challenge(0, improbable=True)


def test_a_size_is_uncertain_by_what_else_may_be_to_blame(selected, late) -> None:
    """Truth: a quarter of the square by which every parameter stands elsewhere with the alternative."""
    fitter, base, candidates = late
    _, (cause,), _ = selected
    lag = fitter.add_candidate(base, candidates["actuator_lag"])
    other = replace(cause, fit=lag.fit, alternatives=(("command_delay", 0.25),),
                    alternative_sets=(replace(lag, added=candidates["command_delay"], fit=cause.fit),))  # fmt: skip
    moved = cause.fit.flights[0].point - lag.fit.flights[0].point
    assert moved.any()
    np.testing.assert_allclose(variance_by_alternatives(cause, [cause, other]), 0.25 * moved**2)
    assert not variance_by_alternatives(cause, [cause]).any()


def test_its_table_holds_what_decides(selected) -> None:
    _, (cause,), _ = selected
    table = cause.table
    assert (table.label, table.share) == ("command_delay", cause.share)
    assert table.alternative_share == max((p for _, p in cause.alternatives), default=0.0)


def test_the_power_that_it_removes_is_never_negative(selected) -> None:
    chosen, (cause,), _ = selected
    removed = power_left(cause.without.evidence) - power_left(chosen.evidence)
    np.testing.assert_allclose(cause.power_removed, np.maximum(removed, 0.0))
    assert cause.power_removed.max() > 0.0
