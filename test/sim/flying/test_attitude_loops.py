"""The loops of other autopilots. Truth: their control law by hand, and the aircraft's steady rate of roll."""

import jax.numpy as jnp
import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.flying.attitude_loops import ARDUPILOT, PX4, AttitudeLoops
from sysid_node.sim.flying.autopilot import SEEN, autopilot_for

RATE, ERROR, HELD = 0.3, 0.1, -0.2  # rad/s, rad, rad s


@pytest.fixture(scope="module")
def simulator() -> Simulator:
    return Simulator(load_aircraft("cdrw"), rate=100.0)


@pytest.mark.parametrize("loops", [PX4, ARDUPILOT], ids=lambda loops: loops.name)
def test_the_aileron_is_what_the_control_law_asks_for(simulator: Simulator, loops: AttitudeLoops) -> None:
    """The integral of the rate is what the aircraft has turned, here the error itself."""
    pilot = loops.flown_by(autopilot_for(simulator, trim_flight(simulator)), simulator.commands)
    errors = jnp.zeros(len(SEEN)).at[SEEN.index("p")].set(RATE).at[SEEN.index("phi")].set(ERROR)
    integral = jnp.zeros(len(SEEN)).at[SEEN.index("phi")].set(HELD)
    found = pilot.gains @ errors + pilot.integral @ integral
    d, reference = simulator.aircraft.derivatives, simulator.aircraft.reference
    steady = -d["Cl_da"].value / d["Cl_p"].value * 2.0 * reference.airspeed / simulator.aircraft.geometry.b
    demanded, feedforward = -ERROR / loops.time_constant, 1.0 / steady
    wrong = -HELD / loops.time_constant - ERROR  # the integral of the rate's error
    wanted = demanded + loops.roll.proportional * (demanded - RATE) + loops.roll.integral * wrong
    assert float(found[simulator.commands.index("aileron")]) == pytest.approx(feedforward * wanted)


def test_rudder_and_thrust_stay_as_they_are(simulator: Simulator) -> None:
    own = autopilot_for(simulator, trim_flight(simulator))
    flown = PX4.flown_by(own, simulator.commands)
    for control in ("rudder", "thrust"):
        row = simulator.commands.index(control)
        np.testing.assert_array_equal(flown.gains[row], own.gains[row])
        np.testing.assert_array_equal(flown.integral[row], own.integral[row])
