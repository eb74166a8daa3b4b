"""Servos' times beside the aircraft file's. Truth: lag plus delay; of second order 2 damping / natural frequency."""

import math
from dataclasses import replace

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.online.estimates.servo_gap import ServoGap, servo_gaps, servo_times_in_file, surely_late
from sysid_node.online.types import DerivativeEstimate


def test_what_the_file_says_of_lag_and_delay_adds_up() -> None:
    effects = {
        "actuator_lag": {"elevator": UncertainValue(0.03), "damping": UncertainValue(0.7)},
        "command_delay": {"elevator": UncertainValue(0.02), "aileron": UncertainValue(0.01)},
    }
    found = servo_times_in_file(replace(load_aircraft("cdrw"), effects=effects))
    assert found == pytest.approx({"elevator": 2.0 * 0.7 * 0.03 + 0.02, "aileron": 0.01})


def test_a_file_that_is_silent() -> None:
    assert servo_times_in_file(replace(load_aircraft("cdrw"), effects={})) == {}


def test_servos_whose_time_is_known_are_compared() -> None:
    def estimated(name: str, valid: bool) -> DerivativeEstimate:
        return DerivativeEstimate(name, 0.038, 0.0015, 0.035, 0.041, valid, "ok" if valid else "converging")

    estimates = {"elevator": estimated("elevator", True), "aileron": estimated("aileron", True)}
    elevator, aileron = servo_gaps({"elevator": 0.03}, estimates | {"rudder": estimated("rudder", False)})
    assert elevator == ServoGap("elevator", 0.038, 0.0015, 0.03)
    assert aileron.control == "aileron" and math.isnan(aileron.in_file)


def test_surfaces_that_surely_act_late() -> None:
    """By hand: more than three standard errors, and valid."""
    rows = {"elevator": (0.038, 0.012, True), "aileron": (0.03, 0.012, True), "rudder": (0.2, 0.012, False)}
    estimates = {
        name: DerivativeEstimate(name, value, error, value - 2.0 * error, value + 2.0 * error, valid, "")
        for name, (value, error, valid) in rows.items()
    }
    assert surely_late(estimates) == ["elevator"]
