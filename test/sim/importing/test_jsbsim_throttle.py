"""How an imported JSBSim model's thrust follows its throttle. Truth: JSBSim's engines, steady and in flight."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from sysid_node.sim.importing.jsbsim.files import copy_model
from sysid_node.sim.importing.jsbsim.program import Program
from sysid_node.sim.importing.jsbsim.read import read_model


@pytest.mark.parametrize(("name", "speed", "lag"), [("T37", 77.0, (0.02, 0.4)), ("c172p", 52.0, (0.8, 2.0))])
def test_thrust_follows_a_small_change_of_the_throttle(name, speed, lag, tmp_path):
    """Within 10 % of what the engines' steady thrust does; a propeller follows more slowly than a turbine."""
    model = read_model(name, speed, 900.0)
    aircraft, state = model.imported.aircraft, model.steady.state
    program = Program(copy_model(model.files, tmp_path, {p for s in model.surfaces for p in s.properties}))
    steady = []
    for throttle in (state.throttle - 0.05, state.throttle + 0.05):
        program.put(replace(state, throttle=throttle), {})
        steady.append(program.loads().engine[0])
    assert 0.1 * aircraft.throttle.max_thrust == pytest.approx(np.diff(steady)[0], rel=0.1)
    assert lag[0] < aircraft.effects["motor_lag"]["time_constant"].value < lag[1]
