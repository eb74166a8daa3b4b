"""The mean lift tells of the airspeed's and the mass's units. Truth: level flight, L = m g = rho V^2 S CL / 2."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputWarning
from sysid_node.flight.live.mean_lift import REMEMBERED, MeanLift, RecentMeanLift, checked_lift, mean_lift
from sysid_node.flight.record import FlightRecord

CDRW = load_aircraft("cdrw")
TIME = np.arange(0.0, 10.0, 0.01)


def level(
    airspeed: float = 18.0, aircraft: Aircraft = CDRW, seconds: float = 10.0, vane: bool = True, scale: float = 1.0
) -> FlightRecord:
    """Level flight at an airspeed (m/s) that the record gives ``scale`` times."""
    g, rho = 9.80665, 1.2
    lift = aircraft.mass * g / (0.5 * rho * airspeed**2 * aircraft.geometry.S)
    derivatives = aircraft.derivatives
    alpha = (lift - derivatives["CL_0"].value) / derivatives["CL_alpha"].value if vane else math.nan
    time = TIME[seconds > TIME]
    values = {"az": -g, "V": scale * airspeed, "alpha": alpha, "rho": rho}
    return FlightRecord(time, {name: np.full(time.size, value) for name, value in values.items()}, "made")


def test_level_flight_at_any_speed_is_taken_without_a_word() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for airspeed in (11.0, 18.0, 40.0):
            checked_lift(CDRW, level(airspeed))
        checked_lift(CDRW, level(28.0, vane=False))


def test_airspeed_in_another_unit_is_warned_of_with_vanes() -> None:
    with pytest.warns(InputWarning, match=r"made: mean lift coefficient is 0\.02 .* 64\.8 m/s, and 0\.26 .*in m/s"):
        checked_lift(CDRW, level(scale=3.6))


def test_airspeed_in_another_unit_is_warned_of_without_vanes() -> None:
    with pytest.warns(InputWarning, match=r"mean airspeed is 64\.8 m/s.* hold for 18 m/s: is the airspeed in m/s"):
        checked_lift(CDRW, level(scale=3.6, vane=False))


def test_a_mass_in_grams_is_warned_of() -> None:
    with pytest.warns(InputWarning, match=r"mean lift coefficient is 256.*the mass in kg"):
        checked_lift(replace(CDRW, mass=4000.0), level())


def test_an_angle_in_degrees_is_warned_of() -> None:
    flight = level()
    with pytest.warns(InputWarning, match="the angle of attack in rad"):
        checked_lift(CDRW, FlightRecord(TIME, {**flight.columns, "alpha": np.degrees(flight["alpha"])}, "made"))


def test_an_angle_of_the_wrong_sign_is_told_from_other_mistakes() -> None:
    flight = level()
    opposite = FlightRecord(TIME, {**flight.columns, "alpha": -flight["alpha"]}, "made")
    assert mean_lift(CDRW, opposite).opposite_alpha
    with pytest.warns(InputWarning, match=r"0\.26 .* and -0\.2\d .*: is the sign of the angle of attack right\?"):
        checked_lift(CDRW, opposite)
    degrees = FlightRecord(TIME, {**flight.columns, "alpha": np.degrees(flight["alpha"])}, "made")
    assert not any(mean_lift(CDRW, other).opposite_alpha for other in (flight, degrees, level(scale=3.6)))
    assert not mean_lift(CDRW, level(vane=False)).opposite_alpha


def test_a_short_flight_and_a_stall_say_nothing() -> None:
    stalled = level()
    stalled = FlightRecord(TIME, {**stalled.columns, "alpha": np.full(TIME.size, 0.5)}, "made")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked_lift(CDRW, level(seconds=4.0, scale=3.6))
        checked_lift(CDRW, stalled)


def test_pieces_count_like_the_whole() -> None:
    flight, lift = level(scale=3.6), MeanLift(CDRW)
    columns = [flight[name] for name in ("az", "V", "alpha", "rho")]
    for part in np.array_split(np.arange(TIME.size), 4):
        lift.add(TIME[part], *(column[part] for column in columns))
    with pytest.warns(InputWarning, match=r"0\.02 "):
        lift.check("made")


def flown(begin: float = 0.0, mean: RecentMeanLift | None = None, **flight: float) -> RecentMeanLift:
    """The mean of 10 s of level flight, taken one sample at a time; what is said before it is known is nothing."""
    mean, record = mean or RecentMeanLift(CDRW), level(**flight)  # type: ignore[arg-type]
    for time, *sample in zip(TIME + begin, *(record[name] for name in ("az", "V", "alpha", "rho")), strict=True):
        assert mean.fault == "" or mean.seconds >= REMEMBERED
        mean.add(float(time), *map(float, sample))
    return mean


@pytest.mark.parametrize("vane", [True, False])
def test_in_flight_airspeed_in_another_unit_is_said(vane: bool) -> None:
    said = flown(scale=3.6, vane=vane).fault
    assert "64.8 m/s" in said
    assert "is the airspeed in m/s" in said


def test_in_flight_knots_are_said_where_there_is_a_vane() -> None:
    assert "0.07 by the weight" in flown(scale=1.944).fault


def test_in_flight_an_angle_of_the_wrong_sign_is_told() -> None:
    mean, record = RecentMeanLift(CDRW), level()
    for time, az, airspeed, alpha, rho in zip(TIME, *(record[n] for n in ("az", "V", "alpha", "rho")), strict=True):
        mean.add(float(time), float(az), float(airspeed), -float(alpha), float(rho))
    assert mean.opposite_alpha
    assert "is the sign of the angle of attack right?" in mean.fault
    assert not flown().opposite_alpha


def test_in_flight_nothing_is_said_of_what_goes_together_or_rolls_on_wheels() -> None:
    for airspeed in (11.5, 18.0, 40.0):
        assert flown(airspeed=airspeed).fault == ""
    assert flown(scale=0.2).fault == ""  # the weight would ask for 25 times the lift


def test_in_flight_what_was_wrong_long_ago_is_forgotten() -> None:
    mean = flown(scale=1.944)
    for repeat in range(1, 4):
        mean = flown(10.0 * repeat, mean)
    assert mean.fault == ""
