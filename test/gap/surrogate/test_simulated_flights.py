"""Which simulated flights suffice, and which part of them is held out; truth: the records as they are made here."""

from __future__ import annotations

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.surrogate.simulated_flights import require_simulated, split

AIRCRAFT = load_aircraft("cdrw")


def made(seconds: float, moved: dict[str, tuple[float, float]], seed: int = 1) -> GapFlight:
    """A record of random motion in which each control is moved between two times."""
    time = np.arange(0.0, seconds, 0.01)
    random = np.random.default_rng(seed)
    columns = {name: random.standard_normal(time.size) for name in ("ax", "ay", "az", "p", "q", "r")}
    for symbol in AIRCRAFT.control_symbols:
        begin, end = moved.get(symbol, (0.0, 0.0))
        columns[symbol] = np.where((time >= begin) & (time < end), 0.1 * np.sign(np.sin(6.0 * time)), 0.0)
    return GapFlight(FlightRecord(time, columns), 100.0, 100.0, 100.0, source=f"simulated{seed}")


EVERYTHING = dict.fromkeys(("de", "da", "dr"), (0.0, 1000.0))


def test_one_flight_is_divided_and_its_last_third_held_out() -> None:
    fitted, held_out = split(AIRCRAFT, [made(60.0, EVERYTHING)])
    assert [f.record.duration for f in fitted] == pytest.approx([40.0], abs=0.02)
    assert [f.record.duration for f in held_out] == pytest.approx([20.0], abs=0.02)


def test_the_last_of_several_flights_is_held_out() -> None:
    flights = [made(30.0, EVERYTHING, seed) for seed in (1, 2)]
    assert split(AIRCRAFT, flights) == ([flights[0]], [flights[1]])


def test_flights_of_one_axis_each_are_all_divided() -> None:
    flights = [made(30.0, {symbol: (0.0, 30.0)}, seed) for seed, symbol in enumerate(("de", "da", "dr"))]
    fitted, held_out = split(AIRCRAFT, flights)
    assert len(fitted) == len(held_out) == 3


def test_an_axis_that_is_not_moved_is_said() -> None:
    flight = made(60.0, {"de": (0.0, 60.0), "da": (0.0, 60.0)})
    with pytest.raises(InputError, match=r"simulated1: the simulated flights hardly move rudder; fly .*sysid excite"):
        split(AIRCRAFT, [flight])


def test_an_axis_that_is_moved_only_where_the_flight_is_held_out_is_said() -> None:
    flight = made(60.0, {**EVERYTHING, "dr": (45.0, 60.0)})
    with pytest.raises(InputError, match=r"hardly move rudder but in their last third.*repeat the manoeuvre"):
        split(AIRCRAFT, [flight])


def test_too_little_flight_is_said() -> None:
    with pytest.raises(InputError, match=r"12 s of simulated flight; .* less than 30 s"):
        require_simulated([made(12.0, EVERYTHING)], [])


def test_a_part_of_the_real_flight_is_not_a_simulated_one() -> None:
    real, other = made(60.0, EVERYTHING, 1), made(60.0, EVERYTHING, 2)
    fitted, _ = split(AIRCRAFT, [real])
    require_simulated([other], [real])
    with pytest.raises(InputError, match=r"is the same recording as simulated1"):
        require_simulated([GapFlight(fitted[0].record, 100.0, 100.0, 100.0, source="a copy of it")], [real])
