"""Readings that stand still. Truth: what was made to stand still, and nothing else."""

import math

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.live.unchanging import (
    BREAK,
    LASTED,
    READINGS,
    UnchangingReadings,
    changing_readings,
    checked_readings,
    unchanging_places,
)
from sysid_node.flight.record import FlightRecord

CDRW = load_aircraft("cdrw")

SECONDS = LASTED + 1.0
AY, P, R, ALPHA, BETA = 1, 3, 5, 7, 8


def flown(still: set[int], begin: float = 0.0, readings: UnchangingReadings | None = None) -> UnchangingReadings:
    """100 Hz of readings that move, but those that stand still; the density after them never moves."""
    readings = readings or UnchangingReadings()
    for k in range(round(100 * SECONDS)):
        moving = (math.sin(0.7 * k + place) for place in range(len(READINGS)))
        sample = [0.0 if place in still else value for place, value in enumerate(moving)]
        readings.add(begin + 0.01 * k, (*sample, 1.2))
    return readings


@pytest.mark.parametrize("place", range(len(READINGS)))
def test_one_that_stands_still_is_named(place: int) -> None:
    readings = flown({place})
    assert readings.places == {place}
    assert readings.fault.startswith(f"{READINGS[place]}: no change for 10 s")
    assert ("must be NaN" in readings.fault) == (place in {ALPHA, BETA})


def test_nothing_is_said_where_all_move() -> None:
    readings = flown(set())
    assert readings.places == set()
    assert readings.fault == ""
    assert readings.coefficients == frozenset()


def test_one_that_moves_again_is_well_again() -> None:
    assert flown(set(), SECONDS, flown({P})).fault == ""


def test_a_force_concerns_its_own_coefficients_and_a_rate_concerns_all() -> None:
    assert flown({AY}).coefficients == {"CY"}
    assert flown({0, AY}).coefficients == {"CL", "CD", "CY"}
    assert flown({P}).coefficients is None
    assert flown({AY, P}).coefficients is None


def test_a_symmetric_flight_without_noise_is_no_fault() -> None:
    """Its lateral readings are zero all the time; where everything stands still the last sample is repeated."""
    assert flown({AY, P, R, BETA}).places == set()
    assert flown({AY, P, R, BETA, ALPHA}).places == {ALPHA}
    assert flown(set(range(len(READINGS)))).places == set(range(len(READINGS)))


def test_flow_angles_that_are_not_measured_do_not_stand_still() -> None:
    readings = UnchangingReadings()
    for k in range(round(100 * SECONDS)):
        readings.add(0.01 * k, (*(math.sin(0.7 * k + i) for i in range(7)), math.nan, math.nan, 1.2))
    assert readings.fault == ""


def test_a_pause_does_not_count() -> None:
    readings = UnchangingReadings()
    for begin in (0.0, 9.0 + 2.0 * BREAK):
        for k in range(900):
            readings.add(begin + 0.01 * k, (0.0,) * 10)
    assert readings.fault == ""


def recorded(still: set[int], seconds: float = SECONDS) -> FlightRecord:
    time = np.arange(round(100 * seconds)) / 100.0
    names = ("ax", "ay", "az", "p", "q", "r", "V", "alpha", "beta")
    moving = {name: 20.0 + np.sin(70.0 * time + place) for place, name in enumerate(names)}
    columns = {
        name: moving[name] if place not in still else np.full(time.size, 20.0) for place, name in enumerate(names)
    }
    return FlightRecord(time, columns, "made")


@pytest.mark.parametrize("place", range(len(READINGS)))
def test_of_a_recorded_flight_the_same_is_said(place: int) -> None:
    assert unchanging_places(CDRW, recorded({place})) == {place}
    said = f"made: {READINGS[place]}: no change for 10 s"
    with pytest.warns(InputWarning, match=said):
        checked_readings(CDRW, recorded({place}))
    with pytest.raises(InputError, match=said):
        changing_readings(CDRW, recorded({place}))


def test_recorded_steady_flight_without_noise_is_no_fault() -> None:
    longitudinal, lateral = {0, 2, 4, 6, 7}, {AY, P, R, BETA}
    for still in (longitudinal, lateral, longitudinal | lateral):
        assert unchanging_places(CDRW, recorded(still)) == set()
    assert unchanging_places(CDRW, recorded(longitudinal | {BETA})) == {BETA}


def test_a_short_record_says_nothing() -> None:
    record = recorded({ALPHA}, seconds=9.0)
    assert changing_readings(CDRW, record) is record
