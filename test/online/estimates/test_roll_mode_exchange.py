"""Roll mode and servo that exchange their time constants. Truth: the simulated aircraft, and its roll mode."""

import math

import pytest

from bench.estimation.all_imperfections import MULTISINE, RATE, estimated, fly
from sysid_node.aircraft.load import load_aircraft
from sysid_node.gap.flightdata.time_scales import roll_subsidence
from sysid_node.online.estimates.roll_mode_exchange import roll_time_constant
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler

AIRCRAFT = load_aircraft("kestrel")  # it rolls with a time constant of 0.05 s


def test_the_time_constant_is_that_of_the_roll_mode() -> None:
    mode = roll_time_constant(AIRCRAFT, AIRCRAFT.derivatives["Cl_p"].value)
    assert mode == pytest.approx(1.0 / (2.0 * math.pi * roll_subsidence(AIRCRAFT)), rel=1e-9)
    assert mode == pytest.approx(0.055, abs=0.005)
    assert math.isinf(roll_time_constant(AIRCRAFT, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("lag", [0.06, 0.13])
def test_a_servo_that_is_slower_than_the_roll_does_not_pass_for_the_roll(lag: float) -> None:
    """Of a servo of 0.13 s the identifier finds 0.06 s in still air, and of ``Cl_p`` half: 13 standard errors off."""
    servos = {"actuator_lag": dict.fromkeys(AIRCRAFT.controls, lag)}
    sortie = fly(Simulator(AIRCRAFT, RATE), servos, "none", 9787, MULTISINE)
    derivatives, late = estimated("replay", AIRCRAFT, FlightSampler().record(sortie), "auto")
    rolling = {name: d for name, d in derivatives.items() if name in ("Cl_beta", "Cl_p", "Cl_da")}
    for name, found in rolling.items():
        assert found.valid == (lag < 0.1), name
        assert not found.valid or abs(found.value - sortie.derivatives[name]) < 3.0 * found.standard_error, name
    assert late["aileron"].valid == (lag < 0.1)
