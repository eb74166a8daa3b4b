"""What the commands foretell parts an effect from what merely answers to gusts; truth: what was flown."""

import pytest

from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.checkpoint import Steps
from sysid_node.gap.estimation.fit import blank
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.instruments.bayes_factor import advantage
from sysid_node.gap.residuals.build import view_of
from sysid_node.gap.selection.candidate_fitter import Trier
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def tried(aircraft, make_flight):
    """Nuisances alone and with a candidate, fitted to a flight in moderate turbulence."""

    def fits(effects, label):
        flight = make_flight(effects, seed=9, turbulence="moderate", duration=40.0)
        view = view_of(Simulator(aircraft, 50.0), flight)
        nuisances = nuisances_of(aircraft, view)
        trier = Trier(nuisances, Steps())
        base = trier.trial(blank([view], nuisances), [])
        (candidate,) = (c for c in candidates_of(view.simulator, [view]) if c.label == label)
        return base, trier.beside(base, candidate)

    return fits


def test_what_was_not_flown_does_not_show_in_what_was_commanded(tried) -> None:
    """Other moments of inertia answer to gusts otherwise, and gusts there are."""
    base, trial = tried({}, "inertia_error")
    assert advantage(trial.fit, base.fit) < 3.0


def test_a_lag_shows_in_what_was_commanded(tried) -> None:
    base, trial = tried({"actuator_lag": {"time_constant": 0.08}}, "actuator_lag")
    assert advantage(trial.fit, base.fit) > 20.0
    assert advantage(trial.fit, trial.fit) == pytest.approx(0.0, abs=1e-9)
