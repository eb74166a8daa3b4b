"""The time of a failure is found from afar; truth: the onset that was flown, while the surface moves or rests."""

import pytest
from gap_flights import fly

from sysid_node.aircraft.model import Aircraft
from sysid_node.gap.estimation.candidate_fit import CandidateFit, unfitted, with_candidates
from sysid_node.gap.estimation.candidates import Candidate, candidates_of
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.instruments.liml import liml_estimate
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.onset import search_onset
from sysid_node.gap.validation.standard_errors import standard_errors
from sysid_node.sim import Simulator


def fitted(aircraft: Aircraft, onset: float, start: float, turbulence: str = "none") -> tuple[CandidateFit, Candidate]:
    """An elevator that loses half its effect at a time (s), its onset and loss fitted from a start."""
    effects = {"control_effectiveness_loss": {"elevator": 0.5, "onset": onset}}
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, effects, seed=15, turbulence=turbulence))
    nuisances = nuisances_of(aircraft, model)
    label = "control_effectiveness_loss of elevator"
    (candidate,) = (c for c in candidates_of(model.simulator, [model]) if c.label == label)
    return converged(with_candidates(unfitted([model], nuisances), [candidate], nuisances, (0.2, start))), candidate


def test_an_onset_is_found_though_the_fit_starts_seconds_away(aircraft) -> None:
    far, candidate = fitted(aircraft, 18.0, 6.0)
    loss, onset = (far.indices.index(i) for i in candidate.indices)
    assert abs(far.values[onset] - 18.0) > 2.0
    found = converged(search_onset(far, candidate))
    assert found.values[onset] == pytest.approx(18.0, abs=0.5)
    errors = standard_errors(found)
    assert errors[onset] < 0.3
    assert abs(found.values[loss] - 0.5) < 3.0 * errors[loss] < 0.03


def test_of_an_onset_while_the_surface_rests_the_gusts_tell_little(aircraft) -> None:
    """No elevator is flown from 11 to 17 s; what it lost is known as well as it is from after that."""
    far, candidate = fitted(aircraft, 13.0, 16.0, "light")
    loss, onset = (far.indices.index(i) for i in candidate.indices)
    found = liml_estimate(converged(search_onset(far, candidate)))
    errors = standard_errors(found)
    assert 0.8 < errors[onset] < 5.0
    assert abs(found.values[onset] - 13.0) < 2.0 * errors[onset]
    assert abs(found.values[loss] - 0.5) < 2.0 * errors[loss] < 0.2
