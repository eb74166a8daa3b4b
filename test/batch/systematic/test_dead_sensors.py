"""Estimates from flights with a dead sensor. Truth: the flight before one reading was made to stand still."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, flight

from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.systematic.dead_sensors import without_dead_sensors
from sysid_node.flight.record import FlightRecord

FLIGHT = flight(1)
FIT = equation_error(KESTREL, [FLIGHT])


def stopped(name: str, begin: float = 0.0, end: float = np.inf) -> FlightRecord:
    """The flight, one reading of which stands still from ``begin`` to ``end``, s."""
    still = (FLIGHT.time >= begin) & (FLIGHT.time <= end)
    return dataclasses.replace(FLIGHT, columns={**FLIGHT.columns, name: np.where(still, FLIGHT[name][0], FLIGHT[name])})


def withheld(*records: FlightRecord) -> set[str]:
    estimates = without_dead_sensors(FIT, KESTREL, records).estimates
    found = {name for name, estimate in estimates.items() if estimate.status == "stale input"}
    assert not any(estimates[name].valid for name in found)
    assert all(estimates[name] == FIT.estimates[name] for name in set(estimates) - found)
    return found


def test_a_sound_flight_keeps_all() -> None:
    assert withheld(FLIGHT) == set()


def test_a_dead_accelerometer_concerns_its_force_alone() -> None:
    assert withheld(stopped("ay")) == {name for name in FIT.estimates if name.startswith("CY_")}
    assert withheld(stopped("az")) == {name for name in FIT.estimates if name.startswith(("CL_", "CD_"))}


@pytest.mark.parametrize("name", ["beta", "alpha", "V", "p", "q", "r"])
def test_any_other_dead_sensor_concerns_all(name: str) -> None:
    assert withheld(stopped(name)) == set(FIT.estimates)


def test_one_flight_of_several_is_enough() -> None:
    assert withheld(FLIGHT, stopped("beta")) == set(FIT.estimates)


def test_a_sensor_that_works_again_was_dead_all_the_same() -> None:
    assert withheld(stopped("beta", 0.5, 11.0)) == set(FIT.estimates)
    assert withheld(stopped("beta", 0.5, 9.5)) == set()


def test_the_ground_before_take_off_does_not_count() -> None:
    parked = stopped("p", end=10.5)
    slow = np.where(FLIGHT.time <= 10.5, 0.5, FLIGHT["V"])
    assert withheld(dataclasses.replace(parked, columns={**parked.columns, "V": slow})) == set()


def test_what_is_not_measured_is_not_dead() -> None:
    missing = {**FLIGHT.columns, "beta": np.full(len(FLIGHT), np.nan)}
    assert withheld(dataclasses.replace(FLIGHT, columns=missing)) == set()
