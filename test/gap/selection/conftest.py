"""What the tests of selection share: a flight with late commands, and what may be blamed for it."""

import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.candidates import Candidate, candidates_of
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def late(aircraft) -> tuple[CandidateFitter, FittedSet, dict[str, Candidate]]:
    """A flight with commands 0.1 s late: its fitter, nuisances alone, and some candidates by label."""
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {"command_delay": {"delay": 0.1}}, seed=14))
    nuisances = nuisances_of(aircraft, model)
    fitter = CandidateFitter(nuisances, Checkpoint())
    wanted = ("command_delay", "actuator_lag", "thrust_scale", "stuck_surface of elevator")
    candidates = {c.label: c for c in candidates_of(model.simulator, [model]) if c.label in wanted}
    return fitter, fitter.fit_set(unfitted([model], nuisances), []), candidates
