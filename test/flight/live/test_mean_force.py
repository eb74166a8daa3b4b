"""The mean specific force along z tells of axes and unit. Truth: in level flight it is -g (FRD), whatever the lift."""

import math

import numpy as np
import pytest

from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.live.mean_force import AVERAGED, MeanForce, RecentMeanForce, checked_force, fault_of
from sysid_node.flight.record import FlightRecord

TIME = np.arange(0.0, 10.0, 0.01)


def record(mean: float, seconds: float = 10.0) -> FlightRecord:
    """Level flight with a manoeuvre of half a g."""
    time = TIME[seconds > TIME]
    return FlightRecord(time, {"az": mean * (1.0 + 0.5 * np.sin(2.0 * time))}, "made")


@pytest.mark.parametrize("mean", [-9.8, -5.0, -25.0, 0.0])
def test_flights_pass(mean: float) -> None:
    assert fault_of(mean) == ""
    assert checked_force(record(mean)).name == "made"


def test_reversed_axes_are_refused() -> None:
    with pytest.raises(InputError, match=r"made: mean specific force along z \(down\) is 9\..*body_frame"):
        checked_force(record(9.8))


@pytest.mark.parametrize("mean", [-980.0, -32.2, -50.4])
def test_another_unit_or_many_g_are_refused(mean: float) -> None:
    """cm/s^2, ft/s^2, and the spiral dive of a simulated flight whose aileron jams."""
    said = r"its unit is not m/s\^2 \(in ft/s\^2 .* or the aircraft was out of control\?"
    with pytest.raises(InputError, match=said):
        checked_force(record(mean))


def test_readings_in_g_are_warned_of() -> None:
    with pytest.warns(InputWarning, match="it is in g"):
        checked_force(record(-1.0))


def test_what_is_short_or_not_measured_is_not_checked() -> None:
    assert len(checked_force(record(9.8, seconds=4.0))) == 400
    assert checked_force(FlightRecord(TIME, {}, "made")).name == "made"


def test_pieces_are_the_whole() -> None:
    az = record(-9.8)["az"]
    whole, pieces = MeanForce(), MeanForce()
    whole.add(TIME, az)
    for first in range(0, TIME.size, 137):
        pieces.add(TIME[first : first + 137], az[first : first + 137])
    assert pieces.count == whole.count
    assert (pieces.begin, pieces.end) == (whole.begin, whole.end)
    assert pieces.total == pytest.approx(whole.total, rel=1e-12)


def test_in_flight_it_follows_the_last_seconds() -> None:
    recent = RecentMeanForce()
    for time in TIME:
        recent.add(float(time), 9.8)
        assert bool(recent.fault) == (time >= AVERAGED - 1e-6)
    for time in TIME:
        recent.add(10.0 + float(time), -9.8)
    assert recent.fault == ""
    assert recent.mean == pytest.approx(-9.8 + 19.6 * math.exp(-2.0), rel=0.01)
