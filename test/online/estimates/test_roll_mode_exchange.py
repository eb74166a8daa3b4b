"""Roll mode and servo that exchange their time constants. Truth: the simulated aircraft, and its roll mode."""

import math
from dataclasses import replace

import pytest

from bench.estimation.all_imperfections import MULTISINE, RATE, estimated, fly
from sysid_node.aircraft.load import load_aircraft
from sysid_node.gap.flightdata.time_scales import roll_subsidence
from sysid_node.online.estimates.roll_mode_exchange import roll_time_constant
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler

AIRCRAFT = load_aircraft("kestrel")  # it rolls with a time constant of 0.05 s


def test_the_time_constant_is_that_of_the_roll_mode() -> None:
    """Beside that of the aircraft's modes at the reference condition, and at another airspeed."""
    damping = AIRCRAFT.derivatives["Cl_p"].value
    for times in (1.0, 1.3):
        reference = replace(AIRCRAFT.reference, airspeed=times * AIRCRAFT.reference.airspeed)
        mode = roll_time_constant(AIRCRAFT, damping, times**2)
        assert mode == pytest.approx(1.0 / (2.0 * math.pi * roll_subsidence(replace(AIRCRAFT, reference=reference))))
    assert roll_time_constant(AIRCRAFT, damping) == pytest.approx(0.055, abs=0.005)
    assert math.isinf(roll_time_constant(AIRCRAFT, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["replay", "equation_error"])
@pytest.mark.parametrize("lag", [0.06, 0.13])
def test_a_servo_that_is_slower_than_the_roll_does_not_pass_for_the_roll(lag: float, method: str) -> None:
    """Of a servo of 0.13 s the identifier finds 0.06 s in still air, and of ``Cl_p`` half: 13 standard errors off."""
    servos = {"actuator_lag": dict.fromkeys(AIRCRAFT.controls, lag)}
    sortie = fly(Simulator(AIRCRAFT, RATE), servos, "none", 9787, MULTISINE)
    derivatives, late = estimated(method, AIRCRAFT, FlightSampler().record(sortie), "auto")
    truth = {**{name: sortie.derivatives[name] for name in ("Cl_beta", "Cl_p", "Cl_da")}, "aileron": lag}
    for name, true in truth.items():
        found = {**derivatives, **late}[name]
        assert found.valid or lag > 0.1, name
        assert not found.valid or abs(found.value - true) < 3.0 * found.standard_error, name
