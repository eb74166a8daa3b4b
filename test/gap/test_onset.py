"""The time of a failure is found from afar; truth: the onset that was flown, a surface that moves through it."""

import pytest
from gap_flights import fly

from sysid_node.gap.candidates import candidates_of
from sysid_node.gap.fit import blank, polish, with_candidates
from sysid_node.gap.nuisance import nuisances_of
from sysid_node.gap.onset import sought
from sysid_node.gap.viewing import view_of
from sysid_node.sim import Simulator


def test_an_onset_is_found_though_the_fit_starts_seconds_away(aircraft) -> None:
    effects = {"control_effectiveness_loss": {"elevator": 0.5, "onset": 18.0}}
    view = view_of(Simulator(aircraft, 50.0), fly(aircraft, effects, seed=15))
    nuisances = nuisances_of(aircraft, view)
    label = "control_effectiveness_loss of elevator"
    (candidate,) = (c for c in candidates_of(view.simulator, [view]) if c.label == label)
    far = polish(with_candidates(blank([view], nuisances), [candidate], nuisances, (0.2, 6.0)))
    place = candidate.indices.index(view.simulator.names.index("control_effectiveness_loss.onset"))
    assert abs(far.values[place] - 18.0) > 2.0
    assert polish(sought(far, candidate)).values[place] == pytest.approx(18.0, abs=0.5)
