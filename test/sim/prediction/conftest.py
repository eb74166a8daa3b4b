"""What the tests of predictions share."""

import pytest
from plain import make_aircraft

from sysid_node.sim import Simulator


@pytest.fixture(scope="session")
def fast() -> Simulator:
    return Simulator(make_aircraft(), 200.0)
