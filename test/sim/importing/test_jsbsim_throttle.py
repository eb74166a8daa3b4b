"""The engine's lag of an imported JSBSim model. Truth: JSBSim's own engine, flown with a step of the throttle."""

import numpy as np
import pytest

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from sysid_node.sim.importing.jsbsim.files import copy_model
from sysid_node.sim.importing.jsbsim.program import Program
from sysid_node.sim.importing.jsbsim.read import read_model


@pytest.mark.parametrize(("name", "speed"), [("T37", 77.0), ("c172p", 52.0)])
def test_thrust_lags_the_throttle_as_the_engine_does(name, speed, tmp_path):
    """After one lag the engine has done 55 to 75 % (1 - 1/e: 63 %) of what a step of 0.04 does in six seconds."""
    model = read_model(name, speed, 900.0)
    lag = model.imported.aircraft.effects["motor_lag"]["time_constant"].value
    program = Program(copy_model(model.files, tmp_path, {p for s in model.surfaces for p in s.properties}))
    flown = []
    for step in (0.0, 0.04):
        program.put(model.steady.state, {})
        program.run_for(0.2)
        program.levers(model.steady.state.throttle + step)
        program.run_for(lag)
        early = program.loads().engine[0]
        program.run_for(6.0 - lag)
        flown.append((early, program.loads().engine[0]))
    early, late = np.diff(flown, axis=0)[0]
    assert 0.55 < early / late < 0.75
