"""Surfaces and side forces that are recorded the other way; truth: the readings that were turned around."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from gap_flights import fly, whole

from bench.gap.spikes import gap_flight
from bench.spikes.records import FLIGHTS, belief, part
from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError, InputWarning
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.flightdata.opposite_readings import check_directions

NO_VANES = {"alpha": np.nan, "beta": np.nan}


def said_of(aircraft, flight: GapFlight) -> list[str]:
    """What is said of a flight that is refused or warned of; nothing of one that is taken."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", InputWarning)
        try:
            check_directions(aircraft, flight)
        except InputError as error:
            return [str(error)]
    return [str(one.message) for one in caught if issubclass(one.category, InputWarning)]


def changed(flight: GapFlight, factors: dict[str, float]) -> GapFlight:
    columns = {name: factors.get(name, 1.0) * values for name, values in flight.record.columns.items()}
    return replace(flight, record=replace(flight.record, columns=columns))


def recorded_early(flight: GapFlight, surfaces: list[str], seconds: float) -> GapFlight:
    """The flight of surfaces that act so long after what is recorded of them."""
    columns = dict(flight.record.columns)
    time = flight.record.time
    columns |= {name: np.interp(time + seconds, time, columns[name]) for name in surfaces}
    return replace(flight, record=replace(flight.record, columns=columns))


@pytest.fixture(scope="module")
def in_gusts(aircraft) -> GapFlight:
    return fly(aircraft, {}, seed=3, turbulence="moderate")


@pytest.mark.parametrize(
    ("symbol", "said"), [("de", "Cm_de .* elevator"), ("da", "Cl_da .* aileron"), ("dr", "Cn_dr .* rudder")]
)
def test_a_surface_counted_the_other_way_is_said(aircraft, plain, symbol, said) -> None:
    with pytest.raises(InputError, match=f"flight 1: {said} counted the other way"):
        check_directions(aircraft, changed(plain, {symbol: -1.0}))


def test_all_three_in_gusts_are_said(aircraft, in_gusts) -> None:
    with pytest.raises(InputError, match="is rudder counted the other way"):
        check_directions(aircraft, changed(in_gusts, dict.fromkeys(("de", "da", "dr"), -1.0)))


def test_positions_from_minus_one_to_one_are_said(aircraft, plain) -> None:
    limits = {control.symbol: 1.0 / control.limit for control in aircraft.controls.values() if control.limit}
    with pytest.warns(InputWarning, match="flight 1: .* are the positions from -1 to 1"):
        check_directions(aircraft, changed(plain, limits))


def test_a_lateral_accelerometer_of_the_wrong_sign_is_said(aircraft, plain) -> None:
    with pytest.warns(InputWarning, match="flight 1: .* is the sign of ay right"):
        check_directions(aircraft, changed(plain, {"ay": -1.0}))


def test_it_is_said_without_vanes(aircraft, plain) -> None:
    reversed_aileron = changed(plain, {"da": -1.0, **NO_VANES})
    with pytest.raises(InputError, match="is aileron counted the other way"):
        check_directions(aircraft, whole(aircraft, reversed_aileron))


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_flight_with_surfaces_of_another_effect_is_taken(aircraft, plain, in_gusts, factor) -> None:
    for flight in (plain, in_gusts):
        assert said_of(aircraft, changed(flight, dict.fromkeys(("de", "da", "dr"), factor))) == []


def test_periodic_commands_in_gusts_are_not_taken_for_reversed_ones(aircraft) -> None:
    """With half a period of delay they fit as well, and with the other sign."""
    flight = fly(aircraft, {}, seed=12, turbulence="moderate", manoeuvre=["multisine"], duration=40.0)
    assert said_of(aircraft, flight) == []


@pytest.mark.parametrize("seconds", [0.1, 0.25, 0.4])
def test_late_surfaces_are_not_taken_for_reversed_ones(aircraft, plain, in_gusts, seconds) -> None:
    """Steps of 0.3 s look reversed after 0.25 s; `sysid gap` names how late they are."""
    for flight in (plain, in_gusts):
        assert said_of(aircraft, recorded_early(flight, ["de", "da", "dr"], seconds)) == []


@pytest.mark.parametrize("seconds", [0.05, 0.1])
def test_surfaces_with_late_stamps_are_not_taken_for_reversed_ones(seconds) -> None:
    """A fast aircraft's motion is over before the surfaces seem to move."""
    fast = load_aircraft("kestrel")
    assert said_of(fast, recorded_early(fly(fast, {}, seed=5), ["de", "da", "dr"], -seconds)) == []


@pytest.mark.parametrize("seconds", [0.05, 0.1, 0.15])
def test_late_surfaces_of_a_real_flight_are_not_taken_for_reversed_ones(flights, seconds) -> None:
    """They are 0.06 s late already; of them the estimates without a delay look reversed."""
    flight = FLIGHTS["thor"]
    aircraft = belief(flights, flight)
    as_recorded = gap_flight(aircraft, part(flights, flight, flight.fitted[0]), "thor")
    assert said_of(aircraft, recorded_early(as_recorded, ["de", "da", "dr"], seconds)) == []


@pytest.mark.parametrize("name", FLIGHTS)
def test_real_flights_are_taken(flights, name) -> None:
    flight = FLIGHTS[name]
    aircraft = belief(flights, flight)
    for span in (*flight.fitted, *flight.held):
        assert said_of(aircraft, gap_flight(aircraft, part(flights, flight, span), name)) == []


def test_the_elevator_of_a_real_flight_counted_the_other_way_is_said(flights) -> None:
    flight = FLIGHTS["hfb320"]
    aircraft = belief(flights, flight)
    as_recorded = gap_flight(aircraft, part(flights, flight, flight.fitted[0]), "hfb320")
    with pytest.raises(InputError, match=r"hfb320: Cm_de is \d.* is elevator counted the other way"):
        check_directions(aircraft, changed(as_recorded, {"de": -1.0}))
