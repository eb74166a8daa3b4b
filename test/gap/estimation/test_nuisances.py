"""What is allowed for is the same in all flights that are looked at together."""

from dataclasses import replace

import numpy as np

from sysid_node.gap.estimation.fit import blank, linearised
from sysid_node.gap.estimation.nuisances import gusty, nuisances_of
from sysid_node.gap.estimation.predictive_density import held_out


def test_calm_and_gusty_flights_are_judged_together(aircraft, plain_view) -> None:
    """Air that rises also turns: allowed for in both flights where it is in one, else their unknowns do not match."""
    blown = replace(plain_view, gusts=0.05 * plain_view.record["V"].mean())
    assert gusty(blown) and not gusty(plain_view)
    calm, rough = (nuisances_of(aircraft, view, (plain_view, blown)) for view in (plain_view, blown))
    assert calm.indices == rough.indices and len(calm.indices) > len(nuisances_of(aircraft, plain_view).indices)
    evidence = held_out(linearised(blank([plain_view], calm)), [blown], [rough])
    assert np.isfinite(evidence.total)


def test_flights_without_lateral_instruments_are_judged_beside_others(aircraft, plain_view) -> None:
    alone = replace(plain_view, flight=replace(plain_view.flight, lateral=False))
    names = [nuisances_of(aircraft, view, (plain_view, alone)).indices for view in (plain_view, alone)]
    assert names[0] == names[1]
    assert len(nuisances_of(aircraft, alone).indices) < len(names[0])
