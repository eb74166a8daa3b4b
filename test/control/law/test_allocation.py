"""Controls to joints and back by the file's map."""

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.control.law.allocation import Allocation
from sysid_node.flight.actuation import Actuation


@pytest.mark.parametrize("name", ["cdrw", "cdfp", "kestrel"])
def test_the_way_back_gives_the_controls_again(name: str) -> None:
    aircraft = load_aircraft(name)
    there, back = Allocation.of(aircraft), Actuation.of(aircraft)
    controls = [0.1, -0.05, 0.02][: len(aircraft.controls)]
    found = back.of_message(back.places(there.joints), there.positions(controls, 5.0))
    assert not isinstance(found, str)
    np.testing.assert_allclose(found, [5.0, *controls])
