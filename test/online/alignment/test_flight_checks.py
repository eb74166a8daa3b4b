"""A flight in pieces is checked as one. Truth: a bundled flight, changed by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from harness import ROOT

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.streams import Streams
from sysid_node.online.alignment.flight_checks import FlightChecks
from sysid_node.online.alignment.in_pieces import align_streams

CDRW = load_aircraft("cdrw")


@pytest.fixture(scope="module")
def flight() -> Streams:
    return read_streams(ROOT / "bags" / "cdrw_slow")


def checked(flight: Streams, signs: list[float]) -> np.ndarray:
    """The flight's attitude at its samples, once it is checked with its IMU's readings multiplied by signs (6,)."""
    imu = replace(flight.imu, values=flight.imu.values * signs)
    changed = replace(flight, imu=imu)
    checks = FlightChecks(CDRW)
    attitude = checks.add(align_streams(CDRW, changed, 0.2), imu)
    checks.check("made")
    return attitude


def test_a_sound_flight_is_taken_and_its_attitude_is_that_of_its_messages(flight: Streams) -> None:
    attitude = checked(flight, [1.0] * 6)
    assert np.isfinite(attitude).all()
    assert attitude[100].tolist() in flight.imu.attitude[:200].tolist()


def test_the_whole_imu_in_other_axes_is_named_by_its_force(flight: Streams) -> None:
    """Lift tells it first: x forward, y left, z up."""
    with pytest.raises(InputError, match="mean specific force along z"):
        checked(flight, [1.0, -1.0, -1.0, 1.0, -1.0, -1.0])


def test_rates_in_other_axes_are_named(flight: Streams) -> None:
    with pytest.raises(InputError, match="made: q, r: the sign is wrong"):
        checked(flight, [1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
