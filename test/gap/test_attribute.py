"""Two effects that bend to hold each other's share are both named; truth: the effects that were flown."""

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap import trials as module
from sysid_node.gap.attribute import attribute
from sysid_node.gap.candidates import candidates_of
from sysid_node.gap.fit import blank
from sysid_node.gap.nuisance import nuisances_of
from sysid_node.gap.steps import Steps
from sysid_node.gap.trials import Trier
from sysid_node.gap.viewing import view_of
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def weak_and_slow(aircraft):
    """An engine that is slow and weak: slow alone, twice as slow would do nearly as well."""
    effects = {"motor_lag": {"time_constant": 0.7}, "thrust_scale": {"error": -0.4}}
    view = view_of(Simulator(aircraft, 50.0), fly(aircraft, effects, seed=16))
    return attribute([view], nuisances_of(aircraft, view), lambda s, t: None)


def test_both_of_two_effects_are_named_with_their_sizes(weak_and_slow) -> None:
    fit = weak_and_slow.chosen.fit
    assert fit.effects == {"motor_lag", "thrust_scale"}
    names = fit.views[0].simulator.names
    found = {names[i]: fit.points[0][i] for i in fit.indices}
    assert found["motor_lag.time_constant"] == pytest.approx(0.7, rel=0.15)
    assert found["thrust_scale.error"] == pytest.approx(-0.4, rel=0.15)


def test_what_adds_up_is_no_alternative(weak_and_slow) -> None:
    """Each predicts much better beside the other, so that neither takes the other's probability away."""
    assert all(cause.share > 0.9 for cause in weak_and_slow.causes)


def test_what_gives_no_numbers_is_no_explanation(plain_view, monkeypatch) -> None:
    """As where the slopes of a mode that feeds itself grow without end."""

    def endless(*args: object) -> None:
        raise np.linalg.LinAlgError("not positive definite")

    nuisances = nuisances_of(plain_view.simulator.aircraft, plain_view)
    trier = Trier(nuisances, Steps())
    base = trier.trial(blank([plain_view], nuisances), [])
    (candidate,) = (c for c in candidates_of(plain_view.simulator, [plain_view]) if c.label == "command_delay")
    with monkeypatch.context() as patch:
        patch.setattr(module, "judged", endless)
        assert trier.upon(base, (0.0, candidate, (0.02,))) is None
    monkeypatch.setattr(module, "_first_look", endless)
    ((left, looked_at, _),) = trier.looks(base, [candidate], lambda share, text: None)
    assert left == np.inf and looked_at is candidate
