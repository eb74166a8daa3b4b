"""What is allowed for is the same in all flights that are looked at together."""

from dataclasses import replace

import numpy as np

from sysid_node.gap.estimation.candidate_fit import linearised, unfitted
from sysid_node.gap.estimation.nuisances import HeldOutFlight, nuisances_of
from sysid_node.gap.estimation.predictive_density import held_out_evidence
from sysid_node.gap.residuals.air_motion import is_gusty


def test_calm_and_gusty_flights_are_judged_together(aircraft, plain_model) -> None:
    """Air that rises also turns: allowed for in both flights where it is in one, else their unknowns do not match."""
    blown = replace(plain_model, gusts=0.05 * plain_model.record["V"].mean())
    assert is_gusty(blown) and not is_gusty(plain_model)
    calm, rough = (nuisances_of(aircraft, model, (plain_model, blown)) for model in (plain_model, blown))
    assert calm.indices == rough.indices and len(calm.indices) > len(nuisances_of(aircraft, plain_model).indices)
    evidence = held_out_evidence(linearised(unfitted([plain_model], calm)), [HeldOutFlight(blown, rough)])
    assert np.isfinite(evidence.total)


def test_flights_without_lateral_instruments_are_judged_beside_others(aircraft, plain_model) -> None:
    alone = replace(plain_model, flight=replace(plain_model.flight, lateral=False))
    names = [nuisances_of(aircraft, model, (plain_model, alone)).indices for model in (plain_model, alone)]
    assert names[0] == names[1]
    assert len(nuisances_of(aircraft, alone).indices) < len(names[0])
