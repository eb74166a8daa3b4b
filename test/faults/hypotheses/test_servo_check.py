"""Surfaces whose positions are measured beside their commands: exact arithmetic of a first-order lag."""

import math

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.faults.hypotheses import servo_check
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.types import HARD_OVER, NOT_FOLLOWING, STUCK, Fault

AIRCRAFT = load_aircraft("cdrw")
STEP = 0.01


def commanded(time: float) -> list[float]:
    """Elevator, aileron, rudder, rad."""
    return [0.1 * math.sin(3.0 * time), 0.1 * math.cos(2.0 * time), 0.0]


def flown(seconds: float, place: float | None = None, echoed: bool = False, drift: float = 0.0) -> list[Fault]:
    """What is found when the elevator, from 2 s on, stands at ``place`` (moving by ``drift`` rad/s) or follows."""
    state = servo_check.init(AIRCRAFT, FaultMonitorSettings())
    lagged, found = commanded(0.0), []
    for k in range(round(seconds / STEP)):
        now = k * STEP
        asked = commanded(now)
        servo_check.command(state, now, asked)
        lagged = [x + (1.0 - math.exp(-STEP / 0.05)) * (u - x) for x, u in zip(lagged, asked, strict=True)]
        at = asked if echoed else list(lagged)
        if place is not None and now >= 2.0:
            at[0] = place + drift * (now - 2.0)
        found = servo_check.position(state, now, at)
    return found


def test_a_servo_that_follows() -> None:
    assert flown(6.0) == []


def test_commands_that_are_echoed_say_nothing() -> None:
    """An echo is ahead of the lag by no more than the servo's error allows at these rates."""
    assert flown(6.0, echoed=True) == []


@pytest.mark.parametrize(("place", "kind"), [(0.06, STUCK), (-0.34, HARD_OVER)])
def test_a_stuck_surface_shows_at_once(place: float, kind: str) -> None:
    (fault,) = flown(3.6, place)
    assert (fault.kind, fault.part, fault.size) == (kind, "elevator", place)
    assert 2.0 <= fault.since < 3.2  # within one period of the command, which passes by where it stands
    assert fault.found - fault.since == pytest.approx(servo_check.LASTING, abs=2 * STEP)


def test_a_stuck_surface_is_stuck_while_its_command_rests_where_it_stands() -> None:
    """A jam at level flight's deflection shows in each manoeuvre, and is not over after it; it is once it follows."""
    state = servo_check.init(AIRCRAFT, FaultMonitorSettings())
    faults = {}
    for k in range(3000):
        now = k * STEP
        asked = 0.1 if 1.0 <= now < 2.0 or now >= 20.0 else 0.0
        servo_check.command(state, now, [asked, 0.0, 0.0])
        at = 0.0 if now < 22.0 else min(0.1, now - 22.0)
        faults[k] = servo_check.position(state, now, [at, 0.0, 0.0])
    assert [fault.kind for fault in faults[1999]] == [STUCK]
    assert faults[2100][0].since == faults[1999][0].since
    assert faults[2999] == []


def test_a_surface_that_moves_but_not_where_it_should() -> None:
    (fault,) = flown(4.0, -0.2, drift=0.05)
    assert fault.kind == NOT_FOLLOWING


def test_commands_that_come_late_are_waited_for() -> None:
    """A busy machine hands over positions in bursts, and their commands after them."""
    state = servo_check.init(AIRCRAFT, FaultMonitorSettings())
    told, lagged, found = 0, commanded(0.0), []
    for k in range(1000):
        if k % 100 == 0:
            for j in range(told, k):
                servo_check.command(state, j * STEP, commanded(j * STEP))
            told = k
        asked = commanded(k * STEP)
        lagged = [x + (1.0 - math.exp(-STEP / 0.05)) * (u - x) for x, u in zip(lagged, asked, strict=True)]
        found += servo_check.position(state, k * STEP, lagged)
    assert found == []


def test_old_commands_do_not_count() -> None:
    state = servo_check.init(AIRCRAFT, FaultMonitorSettings())
    servo_check.command(state, 0.0, [0.3, 0.0, 0.0])
    for k in range(1000):
        found = servo_check.position(state, 2.0 + k * STEP, [0.0, 0.0, 0.0])
    assert found == []
