"""What the commands foretell parts an effect from what merely answers to gusts; truth: what was flown."""

import pytest

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.instruments.bayes_factor import log_bayes_factor, log_bayes_factor_of_alternatives
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def tried(aircraft, make_flight):
    """Nuisances alone and with a candidate, fitted to a flight in moderate turbulence."""

    def fits(effects, label):
        flight = make_flight(effects, seed=9, turbulence="moderate", duration=29.0)
        model = residual_model_of(Simulator(aircraft, 50.0), flight)
        nuisances = nuisances_of(aircraft, model)
        fitter = CandidateFitter(nuisances, Checkpoint())
        base = fitter.fit_set(unfitted([model], nuisances), [])
        (candidate,) = (c for c in candidates_of(model.simulator, [model]) if c.label == label)
        return base, fitter.add_candidate(base, candidate)

    return fits


@pytest.mark.slow
def test_what_was_not_flown_does_not_show_in_what_was_commanded(tried) -> None:
    """Other moments of inertia answer to gusts otherwise, and gusts there are."""
    base, trial = tried({}, "inertia_error")
    assert log_bayes_factor(trial.fit, base.fit) < 3.0


@pytest.mark.slow
def test_a_lag_shows_in_what_was_commanded(tried) -> None:
    base, trial = tried({"actuator_lag": {"time_constant": 0.08}}, "actuator_lag")
    assert log_bayes_factor(trial.fit, base.fit) > 20.0
    assert log_bayes_factor(trial.fit, trial.fit) == pytest.approx(0.0, abs=1e-9)
    pooled = log_bayes_factor_of_alternatives(trial.fit, base.fit)
    assert pooled > 10.0
    assert log_bayes_factor_of_alternatives(base.fit, trial.fit) == pytest.approx(-pooled)
