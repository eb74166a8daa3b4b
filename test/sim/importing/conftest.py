"""What the tests of importing share."""

import pytest

from sysid_node.sim.importing.jsbsim.read import JsbsimModel, read_model


@pytest.fixture(scope="session")
def cessna() -> JsbsimModel:
    """JSBSim's c172p at 52 m/s and 900 m, read once."""
    return read_model("c172p", 52.0, 900.0)
