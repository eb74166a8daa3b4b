"""The vector of all parameters: conversions both ways, and errors that name the known parameters."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.model import UncertainValue
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
    every = dict.fromkeys(("elevator", "aileron", "rudder"), 4.0)
    assert simulator.effects(["actuator_rate_limit:rate=4"]) == {"actuator_rate_limit": every}


def test_a_control_has_its_own_value_beside_that_of_all(simulator):
    """What is stated for a control is its value; the vector holds what all share, and what each has in addition."""
    theta = simulator.vector(["actuator_lag:elevator=0.12:time_constant=0.03"])
    values = parameters.unpack(simulator.layout, theta)["actuator_lag"]
    assert values["time_constant"] == 0.03
    assert (values["aileron"], values["elevator"]) == (0.0, pytest.approx(0.09))
    stated = parameters.stated(simulator.layout, theta, "actuator_lag")
    assert stated == {"elevator": pytest.approx(0.12), "aileron": 0.03, "rudder": 0.03}
    late = simulator.vector(["command_delay:throttle=0.1"])
    assert parameters.stated(simulator.layout, late, "command_delay") == {"throttle": pytest.approx(0.1)}


def test_the_files_effects_are_the_default_and_what_is_given_replaces_them(aircraft):
    stated = {
        "actuator_lag": dict.fromkeys(("elevator", "aileron", "rudder"), UncertainValue(0.03, 0.01)),
        "mass_error": {"error": UncertainValue(0.1)},
    }
    delays = {**aircraft.delays, "imu": UncertainValue(0.008)}
    simulator = Simulator(replace(aircraft, effects=stated, delays=delays))
    plain = Simulator(aircraft)
    spec = ["actuator_lag:time_constant=0.03", "mass_error:error=0.1", "imu_delay:delay=0.008"]
    np.testing.assert_array_equal(simulator.neutral(), plain.vector(spec))
    slow = simulator.vector(["actuator_lag:elevator=0.12"])
    np.testing.assert_allclose(slow, plain.vector([*spec[1:], "actuator_lag:time_constant=0.03:elevator=0.12"]))
    fast = simulator.vector(["actuator_lag:time_constant=0"])
    np.testing.assert_array_equal(fast, plain.vector(spec[1:]))
    assert simulator.effects([])["mass_error"] == {"error": 0.1}


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
