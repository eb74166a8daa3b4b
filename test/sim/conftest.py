"""What the simulator's tests share."""

import pytest
from plain import make_aircraft

from sysid_node.aircraft.model import Aircraft
from sysid_node.sim import Simulator


@pytest.fixture(scope="session")
def aircraft() -> Aircraft:
    return make_aircraft()


@pytest.fixture(scope="session")
def simulator(aircraft: Aircraft) -> Simulator:
    return Simulator(aircraft, 100.0)
