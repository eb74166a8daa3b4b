"""Two effects that bend to hold each other's share are both named; truth: the effects that were flown."""

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection import acceptance
from sysid_node.gap.selection import candidate_fitter as module
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.selection.forward_selection import attribute
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def weak_and_slow(aircraft):
    """An engine that is slow and weak: slow alone, twice as slow would do nearly as well."""
    effects = {"motor_lag": {"time_constant": 0.7}, "thrust_scale": {"error": -0.4}}
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, effects, seed=16))
    return attribute([model], nuisances_of(aircraft, model), lambda s, t: None)


def test_both_of_two_effects_are_named_with_their_sizes(weak_and_slow) -> None:
    fit = weak_and_slow.chosen.fit
    assert fit.effects == {"motor_lag", "thrust_scale"}
    names = fit.simulator.names
    found = {names[i]: fit.flights[0].point[i] for i in fit.indices}
    assert found["motor_lag.time_constant"] == pytest.approx(0.7, rel=0.15)
    assert found["thrust_scale.error"] == pytest.approx(-0.4, rel=0.15)


def test_what_adds_up_is_no_alternative(weak_and_slow) -> None:
    """Each predicts much better beside the other, so that neither takes the other's probability away."""
    assert all(cause.share > 0.9 for cause in weak_and_slow.causes)


def test_what_gives_no_numbers_is_no_explanation(plain_model, monkeypatch) -> None:
    """As where slopes grow without end."""

    def endless(*args: object) -> None:
        raise np.linalg.LinAlgError("not positive definite")

    nuisances = nuisances_of(plain_model.simulator.aircraft, plain_model)
    fitter = CandidateFitter(nuisances, Checkpoint())
    base = fitter.fit_set(unfitted([plain_model], nuisances), [])
    (candidate,) = (c for c in candidates_of(plain_model.simulator, [plain_model]) if c.label == "command_delay")
    with monkeypatch.context() as patch:
        patch.setattr(module, "competing_evidence", endless)
        assert fitter.add(base, (0.0, candidate, (0.02,))) is None
    monkeypatch.setattr(module, "_first_look", endless)
    ((left, looked_at, _),) = fitter.screen(base, [candidate], lambda share, text: None)
    assert left == np.inf and looked_at is candidate


def test_what_is_needed_lest_the_others_grow_without_end_contributes_without_end(weak_and_slow, monkeypatch) -> None:
    """Where the others alone give no numbers, that is no error of the diagnosis."""

    def endless(*args: object) -> None:
        raise np.linalg.LinAlgError("not positive definite")

    base, chosen = weak_and_slow.base, weak_and_slow.chosen
    assert np.isfinite(acceptance._contributed(base, base, chosen)).all()
    monkeypatch.setattr(acceptance, "VariableProjection", endless)
    assert np.isinf(acceptance._contributed(base, base, chosen)).all()


def test_a_fit_that_begins_where_nothing_is_finite_ends_as_one_without_numbers(weak_and_slow, monkeypatch) -> None:
    """SciPy's own error for it would end the diagnosis."""
    fit = weak_and_slow.chosen.fit
    monkeypatch.setattr(
        VariableProjection, "residual_and_slopes", lambda self, values: np.full(self.matrix.shape[0], np.inf)
    )
    with pytest.raises(np.linalg.LinAlgError, match="diverges"):
        converged(fit, rounds=1)
