"""Deflections from commands. Truth: the step response of a first-order lag, 1 - exp(-t / T)."""

import math

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.faults.model import servo_follower
from sysid_node.faults.model.reference_model import RIPE, IdentifierEstimate
from sysid_node.online.types import SAMPLE_COLUMNS

AIRCRAFT, STEP, LATE = load_aircraft("cdrw"), 0.005, 0.08
FIRST = len(SAMPLE_COLUMNS)


def stepped(time: float) -> list[float]:
    """A sample; the elevator is told 0.1 rad from 15 s on."""
    return [0.0, 0.0, -9.8, 0.0, 0.0, 0.0, 18.0, 0.05, 0.0, 1.2, 0.0, 0.02, 0.1 if time >= 15.0 else 0.0, 0.0, 0.0]


def elevators(valid: bool, until: float) -> list[float]:
    """The elevator's deflection from 15 s on, sample by sample; its servo's time is estimated at 1 s."""
    follower, found = servo_follower.init(AIRCRAFT), []
    for k in range(round(until / STEP)):
        now = k * STEP
        if k == round(1.0 / STEP):
            servo_follower.receive_estimates(follower, now, {"elevator": IdentifierEstimate(LATE, 0.004, valid)})
        sample = servo_follower.deflected(follower, now, stepped(now))
        assert list(sample[:FIRST]) == stepped(now)[:FIRST]
        found.append(sample[FIRST])
    return found[round(15.0 / STEP) :]


def test_an_estimated_servo_is_followed() -> None:
    found = elevators(True, 15.5)
    expected = [0.1 * (1.0 - math.exp(-k * STEP / LATE)) for k in range(len(found))]
    assert found == pytest.approx(expected, abs=0.1 * STEP / LATE)  # the command is taken as straight between samples


def test_without_a_valid_estimate_commands_are_deflections() -> None:
    assert set(elevators(False, 15.1)) == {0.1}


def test_estimates_are_adopted_when_they_are_ten_seconds_old() -> None:
    follower = servo_follower.init(AIRCRAFT)
    servo_follower.receive_estimates(follower, 1.0, {"elevator": IdentifierEstimate(LATE, 0.004, True)})
    servo_follower.deflected(follower, RIPE + 0.9, stepped(0.0))
    assert follower.states.lateness == [0.0, 0.0, 0.0]
    servo_follower.deflected(follower, RIPE + 1.0, stepped(0.0))
    assert follower.states.lateness == [LATE, 0.0, 0.0]


def test_while_the_monitor_learns_they_are_adopted_at_once_and_no_older_ones_later() -> None:
    follower = servo_follower.init(AIRCRAFT)
    for time, late in ((1.0, 0.05), (2.0, LATE)):
        servo_follower.receive_estimates(follower, time, {"elevator": IdentifierEstimate(late, 0.004, True)})
        servo_follower.deflected(follower, time, stepped(0.0), learning=True)
        assert follower.states.lateness == [late, 0.0, 0.0]
    servo_follower.deflected(follower, 1.0 + RIPE, stepped(0.0))
    assert follower.states.lateness == [LATE, 0.0, 0.0]
