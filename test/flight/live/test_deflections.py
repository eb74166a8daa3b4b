"""Deflections beyond the aircraft file's limits tell that positions are not in rad. Truth: the files' limits."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputWarning
from sysid_node.flight.live.deflections import LASTING, DeflectionLimits, checked_deflections
from sysid_node.flight.record import FlightRecord

CDRW = load_aircraft("cdrw")  # each surface moves by 0.35 rad
TIME = np.arange(0.0, 10.0, 0.01)


def moved(amplitude: float, share: float = 1.0) -> FlightRecord:
    """A flight whose elevator makes steps of an amplitude (rad) for a share of the time."""
    steps = amplitude * np.sign(np.sin(TIME)) * (share > TIME % 1.0)
    return FlightRecord(TIME, {"de": steps, "da": 0.0 * TIME, "dr": np.full(TIME.size, np.nan)}, "made")


def test_full_travel_and_a_short_glitch_are_taken_without_a_word() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked_deflections(CDRW, moved(0.4))
        checked_deflections(CDRW, moved(1.0, share=0.05))


def test_positions_from_minus_one_to_one_are_warned_of() -> None:
    with pytest.warns(
        InputWarning, match=r"made: elevator is deflected by up to 1\.00 rad beside a limit of 0\.35 rad"
    ):
        checked_deflections(CDRW, moved(1.0))


def test_nothing_is_said_where_the_file_states_no_limit() -> None:
    free = replace(CDRW, controls={name: replace(control, limit=None) for name, control in CDRW.controls.items()})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked_deflections(free, moved(1.0))


def test_in_flight_it_is_said_once_it_has_lasted() -> None:
    limits = DeflectionLimits(CDRW)
    for time in np.arange(0.0, 3.0, 0.005).tolist():
        limits.add_sample(time, (0.3, -1.0 if time > 1.0 else 0.1, 0.0))
        assert bool(limits.fault) == (time > 1.0 + LASTING) or abs(time - 1.0 - LASTING) < 0.11
    assert limits.fault.startswith("aileron is deflected by up to 1.00 rad")
