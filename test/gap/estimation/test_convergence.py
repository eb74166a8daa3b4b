"""Fits that go on until they settle; truth: the simulator."""

import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.sim import Simulator


def test_an_inertia_far_from_its_start_is_reached(aircraft) -> None:
    """Every pitching moment is smaller by it, as by its derivatives: values that move alone stand at 0.14 for 0.6 after
    three rounds."""
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {"inertia_error": {"Iyy": 0.6}}))
    nuisances = nuisances_of(aircraft, model)
    (candidate,) = [c for c in candidates_of(model.simulator, [model]) if c.effect == "inertia_error"]
    start = with_candidates(converged(unfitted([model], nuisances)), [candidate], nuisances, candidate.starts[0])
    place = candidate.indices.index(model.simulator.names.index("inertia_error.Iyy"))
    assert converged(start, rounds=3).values[place] == pytest.approx(0.6, rel=0.1)
    assert converged(start).values[place] == pytest.approx(0.6, rel=0.1)
