"""A flight's only manoeuvre. Truth: when its steps were flown."""

from dataclasses import replace

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.flightdata.gap_flight import SHORTEST_FLIGHT
from sysid_node.gap.flightdata.manoeuvre_window import cut_to_manoeuvre, step_changes

CONTROLS = ("de", "da", "dr")


def test_the_only_manoeuvre_is_kept_with_what_rings_after_it(aircraft) -> None:
    flight = fly(aircraft, {}, manoeuvre=["3211:elevator:start=20:width=0.3"], duration=50.0)
    cut = cut_to_manoeuvre(flight, CONTROLS)
    assert cut.record.duration == pytest.approx(2.0 + 7 * 0.3 + 5.0, abs=1.0)
    assert cut.left_out == pytest.approx(flight.record.duration - cut.record.duration, abs=0.05)
    assert abs(cut.record["de"]).max() == abs(flight.record["de"]).max()
    assert (cut.record.start_ns - flight.record.start_ns) * 1e-9 == pytest.approx(18.0, abs=0.5)
    assert cut.begin == pytest.approx(18.0, abs=0.5)


def test_a_manoeuvre_at_the_end_keeps_enough_before_it(aircraft) -> None:
    flight = fly(aircraft, {}, manoeuvre=["doublet:elevator:start=47:width=0.3"], duration=50.0)
    cut = cut_to_manoeuvre(flight, CONTROLS)
    assert cut.record.duration == pytest.approx(SHORTEST_FLIGHT, abs=0.05)
    assert abs(cut.record["de"]).max() == abs(flight.record["de"]).max()


@pytest.mark.slow
def test_a_flight_of_the_shortest_length_is_kept(aircraft) -> None:
    flight = fly(aircraft, {}, manoeuvre=["doublet:elevator:start=4:width=0.3"], duration=6.2)
    assert cut_to_manoeuvre(flight, CONTROLS) is flight


def test_manoeuvres_all_over_a_flight_are_kept(aircraft) -> None:
    steps = ["3211:elevator:start=2", "3211:aileron:start=20", "3211:rudder:start=40"]
    flight = fly(aircraft, {}, manoeuvre=steps, duration=50.0)
    assert cut_to_manoeuvre(flight, CONTROLS) is flight


def test_where_nothing_steps_all_is_kept(aircraft) -> None:
    flight = fly(aircraft, {}, manoeuvre=["multisine:elevator"], duration=50.0)
    assert cut_to_manoeuvre(flight, CONTROLS) is flight


def test_a_smooth_manoeuvre_is_kept_though_the_throttle_steps_after_it(aircraft) -> None:
    """The only step is where hardly anything else moves."""
    flight = fly(aircraft, {}, manoeuvre=[], duration=50.0)
    record, late = flight.record, flight.record.time > 40.0
    smooth = {"de": record["de"] + 0.05 * np.sin(2.0 * np.pi * 0.7 * record.time) * ~late}
    stepping = {"thrust": record["thrust"] + 3.0 * late}
    for columns, left_out in (({**smooth, **stepping}, 0.0), (stepping, 30.0)):
        changed = replace(flight, record=replace(record, columns={**record.columns, **columns}))
        assert cut_to_manoeuvre(changed, CONTROLS).left_out >= left_out
        assert (cut_to_manoeuvre(changed, CONTROLS) is changed) == (not left_out)


def test_a_throttle_that_steps_later_belongs_to_the_manoeuvres(aircraft) -> None:
    flight = fly(aircraft, {}, manoeuvre=["3211:elevator:start=2:width=0.3"], duration=50.0)
    record = flight.record
    thrust = record["thrust"] + 3.0 * (record.time > 35.0)
    stepped = replace(flight, record=replace(record, columns={**record.columns, "thrust": thrust}))
    assert cut_to_manoeuvre(flight, CONTROLS).left_out > 30.0
    assert cut_to_manoeuvre(stepped, CONTROLS) is stepped


def test_steps_are_told_from_smooth_motion() -> None:
    """Truth: a sine with one step of 0.2 in it, and a sine alone."""
    time = np.arange(0.0, 20.0, 0.02)
    smooth = 0.05 * np.sin(2.0 * np.pi * 0.3 * time)
    changes = step_changes(np.column_stack([smooth + 0.2 * (time > 7.0), smooth]))
    (place,) = np.flatnonzero(changes[:, 0])
    assert time[place] == pytest.approx(7.02, abs=0.02) and changes[place, 0] == pytest.approx(0.2, abs=0.01)
    assert not changes[:, 1].any()
