"""Causes against their alternatives, fitted; truth: the effect that was flown."""

import pytest
from gap_flights import stage_of

from sysid_node.gap.estimation.candidates import SECOND_ORDER
from sysid_node.gap.selection.alternatives import replace_stepwise


@pytest.fixture(scope="module")
def alone(late):
    """A lag and a delay, each fitted alone to late commands."""
    fitter, base, candidates = late
    return {label: fitter.add_candidate(base, candidates[label]) for label in ("actuator_lag", "command_delay")}


def test_the_true_effect_takes_the_place_of_one_that_resembles_it(late, alone) -> None:
    fitter, base, candidates = late
    stages = [stage_of(alone["actuator_lag"], alone["command_delay"])]
    chosen, (position,) = replace_stepwise(fitter, base, alone["actuator_lag"], stages, [])
    assert chosen.fit is alone["command_delay"].fit
    assert position.candidate is candidates["command_delay"] and position.without is base
    assert {each.added.label for each in position.alternatives} == {"actuator_lag", "command_delay"}


def test_what_is_barred_takes_no_place(late, alone) -> None:
    fitter, base, candidates = late
    stages = [stage_of(alone["actuator_lag"])]
    chosen, (position,) = replace_stepwise(
        fitter, base, alone["actuator_lag"], stages, [candidates["command_delay"]], frozenset({"command_delay"})
    )
    assert chosen is alone["actuator_lag"]
    assert "command_delay" in {each.added.label for each in position.alternatives}  # it is fitted, and weighed


def test_the_true_effect_stays(late, alone) -> None:
    fitter, base, _ = late
    stages = [stage_of(alone["command_delay"], alone["actuator_lag"])]
    chosen, _ = replace_stepwise(fitter, base, alone["command_delay"], stages, [])
    assert chosen is alone["command_delay"]


@pytest.mark.slow
@pytest.mark.parametrize("first", ["command_delay", "imu_scale"])
def test_of_two_effects_that_were_flown_neither_takes_the_others_place(late_and_scaled, first) -> None:
    fitter, base, candidates = late_and_scaled
    fitted = {label: fitter.add_candidate(base, candidate) for label, candidate in candidates.items()}
    chosen, _ = replace_stepwise(fitter, base, fitted[first], [stage_of(*fitted.values())], [])
    labels = {candidate.label for candidate in chosen.fit.candidates}
    better = max(fitted, key=lambda label: fitted[label].evidence.total)
    assert labels == ({first} if first == better else {"command_delay", "imu_scale"})


@pytest.mark.parametrize("first", ["actuator_lag", "command_delay"])
def test_servos_of_second_order_are_told_from_a_lag_and_from_a_delay(oscillating, first) -> None:
    fitter, base, candidates = oscillating
    fitted = {label: fitter.add_candidate(base, candidate) for label, candidate in candidates.items()}
    chosen, _ = replace_stepwise(fitter, base, fitted[first], [stage_of(*fitted.values())], [])
    assert [candidate.label for candidate in chosen.fit.candidates] == [SECOND_ORDER]
    assert chosen.fit.values == pytest.approx([0.06, 0.7], rel=0.05)


@pytest.mark.slow
def test_wrong_derivatives_are_compared_with_every_effect_that_was_fitted_alone(mistaken) -> None:
    """Another cause is compared with the likeliest of them only, and with what delays the response as it does."""
    fitter, base, candidates = mistaken
    names = ("imu_scale", "cg_shift", "mass_error", "inertia_error", "thrust_scale")
    first = [fitter.add_candidate(base, candidates[name]) for name in names]
    delay = fitter.add_candidate(base, candidates["command_delay"])
    both = fitter.add_candidate(delay, candidates["derivative_error of Cm"])
    _, positions = replace_stepwise(
        fitter, base, both, [stage_of(*first, delay), stage_of(both)], [], frozenset(candidates)
    )
    tried = {each.candidate.effect: {a.added.label for a in each.alternatives} for each in positions}
    assert tried["derivative_error"] >= set(names)
    assert not tried["command_delay"] >= set(names)
