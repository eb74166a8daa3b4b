"""Explanations with several effects, accepted and judged; truth: the effects flown."""

import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidates import SECOND_ORDER
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.acceptance import is_accepted
from sysid_node.gap.selection.comparison import Comparison
from sysid_node.gap.selection.forward_selection import attribute, is_better
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def weak_and_slow(aircraft):
    """An engine that is slow and weak: slow alone, twice as slow would do nearly as well."""
    effects = {"motor_lag": {"time_constant": 0.7}, "thrust_scale": {"error": -0.4}}
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, effects, seed=16))
    return attribute([model], nuisances_of(aircraft, model), lambda s, t: None)


@pytest.mark.slow
def test_both_of_two_effects_are_named_with_their_sizes(weak_and_slow) -> None:
    fit = weak_and_slow.chosen.fit
    assert fit.effects == {"motor_lag", "thrust_scale"}
    names = fit.simulator.names
    found = {names[i]: fit.flights[0].point[i] for i in fit.indices}
    assert found["motor_lag.time_constant"] == pytest.approx(0.7, rel=0.15)
    assert found["thrust_scale.error"] == pytest.approx(-0.4, rel=0.15)


@pytest.mark.slow
def test_what_adds_up_is_no_alternative(weak_and_slow) -> None:
    """Each predicts much better beside the other, so that neither takes the other's probability away."""
    assert all(cause.share > 0.9 for cause in weak_and_slow.causes)


@pytest.mark.slow
def test_an_explanation_is_judged_by_what_it_adds_to_the_best_whichever_was_added_first(oscillating) -> None:
    """Truth: servos of second order, for which a delay stood so far. Beside them hardly any delay is left."""
    fitter, base, candidates = oscillating
    best = fitter.add_candidate(base, candidates["command_delay"])
    servos = fitter.add_candidate(base, candidates[SECOND_ORDER])
    both = fitter.add_candidate(servos, candidates["command_delay"])
    assert not is_accepted(Comparison(base, servos, both))  # a delay within one sample
    assert is_better(base, best, (servos, both))
    assert is_better(base, best, (best, fitter.add_candidate(best, candidates[SECOND_ORDER])))
    assert not is_better(base, servos, (best, both))
