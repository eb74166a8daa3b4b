"""What flights tell of the imperfections, and several flights together."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from late_flight import LATE, UNCERTAIN, behind_servos
from made_flight import KESTREL, flight

from sysid_node.batch.settings import BatchSettings
from sysid_node.batch.systematic.flight_posterior import FlightPosterior, flight_posterior
from sysid_node.batch.systematic.online_passes import online_passes


@cache
def posterior(*seeds: int) -> FlightPosterior:
    found = flight_posterior(online_passes(UNCERTAIN, [behind_servos(seed) for seed in seeds], BatchSettings()))
    assert found is not None
    return found


def test_servos_are_found():
    found = posterior(1)
    late = [k for k, one in enumerate(found.imperfections) if one.role == "lateness"]
    assert [found.imperfections[k].control for k in late] == list(KESTREL.controls)
    assert (np.abs(found.mean[late] - LATE) < 3.0 * found.errors[late]).all()
    assert (found.errors[late] < 0.01).all()


def test_more_flights_tell_more_but_not_of_what_they_share():
    """The stamps of controls and motion are off by the same time in all flights, and every servo's time with them."""
    one, four = posterior(1), posterior(1, 1, 1, 1)
    servos = [k for k, imperfection in enumerate(four.imperfections) if imperfection.role == "lateness"]
    keys = [imperfection.key for imperfection in four.imperfections]
    stamps, area = keys.index("delays.actuators"), keys.index("geometry.S")
    # one flight may already tell all that the stamps, which do not average out, leave to be told
    assert four.errors[servos].max() < one.errors[servos].max()
    assert (four.errors[servos] < 1.03 * one.errors[servos]).all()
    assert (four.errors[servos] > 0.9 * four.errors[stamps]).all()
    # no flight tells of the area, whose tolerance counts once
    assert four.errors[area] > 0.99 * UNCERTAIN.tolerances["geometry.S"]


def test_servos_of_several_flights_are_those_of_each():
    """The same flight again and again tells the same servos: not a linearisation that differs from flight to flight."""
    one, four = posterior(1), posterior(1, 1, 1, 1)
    late = [k for k, imperfection in enumerate(one.imperfections) if imperfection.role == "lateness"]
    assert (np.abs(four.mean[late] - one.mean[late]) < one.errors[late]).all()
    assert (np.abs(four.mean[late] - LATE) < 3.0 * four.errors[late]).all()


def test_an_exact_aircraft_has_none():
    assert flight_posterior(online_passes(KESTREL, [flight(1)], BatchSettings())) is None


def test_a_flight_that_tells_nothing_leaves_the_others_as_they_are():
    short = behind_servos(2).between(0.0, 0.3)
    found = flight_posterior(online_passes(UNCERTAIN, [behind_servos(1), short], BatchSettings()))
    assert found is not None
    assert found.mean == pytest.approx(posterior(1).mean)


@pytest.mark.parametrize(("intervals", "slowest"), [((0.1,), 0.1), ((0.0, 0.1), 0.1), ((0.0204,), 0.0)])
def test_the_time_of_a_step_in_a_slow_logs_commands_is_not_known(intervals, slowest):
    """Truth: a uniform distribution's standard deviation, which no number of flights makes smaller."""
    records = [replace(flight(1), commanded=True, command_interval=interval) for interval in intervals]
    found = flight_posterior(online_passes(KESTREL, records, BatchSettings(actuators="commands")))
    if not slowest:
        assert found is None
        return
    assert found is not None
    late = [k for k, one in enumerate(found.imperfections) if one.role == "lateness"]
    assert len(late) == len(KESTREL.controls)
    assert (found.errors[late] > slowest / math.sqrt(12.0)).all()
    assert (np.abs(found.mean[late]) < 0.1 * slowest).all()  # all surfaces are where they were commanded
