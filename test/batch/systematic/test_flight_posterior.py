"""What flights tell of the imperfections, and several flights together."""

from functools import cache

import numpy as np
import pytest
from late_flight import LATE, UNCERTAIN, behind_servos
from made_flight import KESTREL, flight

from sysid_node.batch.settings import BatchSettings
from sysid_node.batch.systematic.flight_posterior import FlightPosterior, flight_posterior


@cache
def posterior(*seeds: int) -> FlightPosterior:
    found = flight_posterior(UNCERTAIN, [behind_servos(seed) for seed in seeds], BatchSettings())
    assert found is not None
    return found


def test_servos_are_found():
    found = posterior(1)
    late = [k for k, one in enumerate(found.imperfections) if one.role == "lateness"]
    assert [found.imperfections[k].control for k in late] == list(KESTREL.controls)
    assert (np.abs(found.mean[late] - LATE) < 3.0 * found.errors[late]).all()
    assert (found.errors[late] < 0.01).all()


def test_a_flight_told_more_often_counts_more_and_its_tolerances_once():
    """Twice the information halves a variance at most, but for the place where the flights are linearised."""
    twice, four = posterior(1, 1), posterior(1, 1, 1, 1)
    ratio = four.errors / twice.errors
    assert np.median(ratio) < 1.0
    assert (ratio > 0.95 * np.sqrt(0.5)).all()
    # no flight tells of the area, whose tolerance counts once
    area = [one.key for one in four.imperfections].index("geometry.S")
    assert four.errors[area] > 0.99 * UNCERTAIN.tolerances["geometry.S"]


def test_an_exact_aircraft_has_none():
    assert flight_posterior(KESTREL, [flight(1)], BatchSettings()) is None


def test_a_flight_that_tells_nothing_leaves_the_others_as_they_are():
    short = behind_servos(2).between(0.0, 0.3)
    found = flight_posterior(UNCERTAIN, [behind_servos(1), short], BatchSettings())
    assert found is not None
    assert found.mean == pytest.approx(posterior(1).mean)
