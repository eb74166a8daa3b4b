"""The vector of all parameters: conversions both ways, and errors that name the known parameters."""

import numpy as np
import pytest

from sysid_node.errors import InputError
from sysid_node.sim import Simulator
from sysid_node.sim.model import parameters


def test_names_and_scales(simulator):
    assert len(simulator.names) == len(set(simulator.names)) == simulator.neutral().size
    assert simulator.names[0] == "command_delay.delay"
    tolerance = simulator.aircraft.derivatives["Cm_alpha"].tolerance
    assert simulator.scales[simulator.names.index("derivative_error.Cm_alpha")] == tolerance
    assert (simulator.scales > 0).all()


def test_values_survive_a_round_trip(simulator):
    theta = simulator.vector(["actuator_lag:time_constant=0.05", "cg_shift:x=0.01:z=-0.02"])
    values = parameters.unpack(simulator.layout, theta)
    assert values["actuator_lag"]["time_constant"] == 0.05
    assert values["cg_shift"] == {"x": 0.01, "y": 0.0, "z": -0.02}
    changed = np.flatnonzero(theta != simulator.neutral())
    assert [simulator.names[i] for i in changed] == ["actuator_lag.time_constant", "cg_shift.x", "cg_shift.z"]
    same = simulator.vector({"actuator_lag": {"time_constant": 0.05}, "cg_shift": {"x": 0.01, "z": -0.02}})
    np.testing.assert_array_equal(theta, same)
    assert simulator.effects(["actuator_rate_limit:rate=4"]) == {"actuator_rate_limit": {"inverse_rate": 0.25}}


@pytest.mark.parametrize(
    ("spec", "pattern"),
    [
        ("aktuator_lag:time_constant=1", r"'aktuator_lag' is not known; known: command_delay, actuator_lag"),
        ("actuator_lag:tau=0.1", r"actuator_lag: 'tau' is not known; known: time_constant"),
        ("actuator_lag:time_constant=-0.1", r"time_constant=-0.1 is impossible; expected 0 to 1 s"),
        ("actuator_lag:time_constant=nan", r"time_constant=nan is impossible"),
        ("actuator_rate_limit:rate=0", r"rate=0 is impossible; expected 0.02 to inf rad/s"),
        ("actuator_lag:time_constant", r"expected key=number, e.g. actuator_lag:time_constant=0.05"),
        ("actuator_lag:time_constant=fast", r"'time_constant=fast': expected key=number"),
        ("stall_separation:alpha_star=0.2", r"does nothing as given; set one of depth, e.g. stall_separation:depth=1"),
        ("control_effectiveness_loss:onset=3", r"set one of elevator, aileron, rudder"),
        ("mass_error:error=-1", r"error=-1 is impossible; expected -0.8 to 3"),
        ("derivative_error:Cm_beta=1", r"derivative_error: 'Cm_beta' is not known; known: CL_0"),
    ],
)
def test_bad_effects_are_one_line(simulator, spec, pattern):
    with pytest.raises(InputError, match=pattern) as caught:
        simulator.vector([spec])
    assert "\n" not in str(caught.value)


def test_rate_must_be_sensible(aircraft):
    with pytest.raises(InputError, match="rate 1 Hz: expected 10 to 10000 Hz"):
        Simulator(aircraft, 1.0)
