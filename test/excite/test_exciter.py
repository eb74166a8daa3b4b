"""Excitation in flight: when it begins, when it stops, and what stops it at once."""

import math

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.excite import exciter
from sysid_node.excite.exciter import LimitedQuantities
from sysid_node.excite.exciter_settings import ExcitationSettings

AIRCRAFT = load_aircraft("cdrw")
LEVEL = LimitedQuantities(0.0, 0.08, 18.0, 1.0)
KNOWN = dict.fromkeys(ExcitationSettings().derivatives, 0.01)
UNKNOWN = dict.fromkeys(ExcitationSettings().derivatives, math.inf)


@pytest.fixture
def state() -> exciter.ExciterState:
    return exciter.init(AIRCRAFT, ExcitationSettings())


def last(state: exciter.ExciterState) -> str:
    return state.events[-1].text


def test_all_events_are_counted_and_the_last_ones_kept(state: exciter.ExciterState) -> None:
    for turn in range(exciter.EVENTS):
        exciter.start(state, float(turn))
        exciter.stop(state, float(turn) + 0.5, "stopped")
    assert state.happened == 2 * exciter.EVENTS
    assert len(state.events) == exciter.EVENTS
    assert state.events[-1].time == exciter.EVENTS - 0.5


def test_nothing_moves_until_asked(state: exciter.ExciterState) -> None:
    exciter.receive_estimates(state, 1.0, UNKNOWN)
    assert not exciter.step(state, 1.0, LEVEL).any()
    assert not state.events


@pytest.mark.parametrize(
    ("flight", "words"),
    [(LEVEL._replace(roll=1.5), "roll 1.5 beyond"), (LEVEL._replace(airspeed=math.nan), "airspeed not measured")],
)
def test_it_does_not_begin_beyond_a_limit(state: exciter.ExciterState, flight: LimitedQuantities, words: str) -> None:
    with pytest.raises(InputError, match=words):
        exciter.start(state, 0.0, flight)
    assert not state.active
    exciter.start(state, 0.0, LEVEL)
    assert state.active


def test_it_flies_the_manoeuvre_and_stops_when_enough_is_known(state: exciter.ExciterState) -> None:
    exciter.start(state, 10.0)
    flown = np.array([exciter.step(state, 10.0 + t, LEVEL) for t in np.arange(0.0, 5.0, 0.01)])
    assert (np.abs(flown).max(axis=0) > 0.01).all()
    assert np.abs(flown).max() <= 0.02 + 1e-9
    exciter.receive_estimates(state, 15.0, {**KNOWN, "Cm_de": 0.06})
    assert state.active
    assert state.estimates.missing == ("Cm_de",)
    exciter.receive_estimates(state, 16.0, KNOWN)
    assert not state.active
    assert last(state) == "known after 6.0 s"
    assert not exciter.step(state, 16.01, LEVEL).any()


@pytest.mark.parametrize(
    ("flight", "words"),
    [
        (LEVEL._replace(roll=1.0), "roll 1"),
        (LEVEL._replace(pitch=-0.6), "pitch -0.6"),
        (LEVEL._replace(airspeed=9.0), "airspeed 9"),
        (LEVEL._replace(load_factor=4.0), "load factor 4"),
        (LEVEL._replace(roll=math.nan), "roll not measured"),
        (LEVEL._replace(airspeed=math.nan), "airspeed not measured"),
    ],
)
def test_a_limit_or_a_silent_sensor_ends_it_at_once_for_good(flight: LimitedQuantities, words: str) -> None:
    state = exciter.init(AIRCRAFT, ExcitationSettings(watch=True))
    exciter.start(state, 0.0)
    assert exciter.step(state, 1.0, LEVEL).any()
    assert not exciter.step(state, 1.005, flight).any()
    assert last(state).startswith(f"aborted: {words}")
    for t in (2.0, 3.0, 4.0):
        exciter.receive_estimates(state, t, UNKNOWN)
    assert not state.active


def test_it_gives_up(state: exciter.ExciterState) -> None:
    exciter.start(state, 0.0)
    exciter.receive_estimates(state, 59.0, {**KNOWN, "Cl_p": 0.5})
    exciter.step(state, 60.5, LEVEL)
    assert not state.active
    assert "Cl_p not known" in last(state)


def test_it_begins_again_when_told_to_watch_and_has_the_estimates_begun_anew() -> None:
    state = exciter.init(AIRCRAFT, ExcitationSettings(watch=True))
    exciter.start(state, 0.0)
    assert not exciter.receive_estimates(state, 5.0, KNOWN)
    lost = {**KNOWN, "Cm_de": math.inf}
    exciter.receive_estimates(state, 20.0, lost)
    assert not state.active  # a moment's doubt is none
    exciter.receive_estimates(state, 20.0 + exciter.INVALID_TIME, lost)
    assert state.active
    assert "Cm_de no longer known" in last(state)
    begun = state.begun
    exciter.receive_estimates(state, begun + 0.5, KNOWN)
    assert state.active  # what is known now is of before
    assert exciter.receive_estimates(state, begun + exciter.RESET_DELAY, lost)
    assert not exciter.receive_estimates(state, begun + exciter.RESET_DELAY + 0.1, lost)
    exciter.receive_estimates(state, begun + 5.0, KNOWN)
    assert not state.active


def test_without_watching_it_stays_quiet(state: exciter.ExciterState) -> None:
    exciter.start(state, 0.0)
    exciter.receive_estimates(state, 5.0, KNOWN)
    for t in (6.0, 7.0, 8.0):
        exciter.receive_estimates(state, t, UNKNOWN)
    assert not state.active


def test_requests_that_make_no_sense(state: exciter.ExciterState) -> None:
    exciter.start(state, 0.0)
    with pytest.raises(InputError, match="under way"):
        exciter.start(state, 1.0)
    exciter.stop(state, 2.0, "stopped on request")
    assert last(state) == "stopped on request after 2.0 s"


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"manoeuvre": ("doublet:elevator:amplitude=0.2",)}, "largest amplitude"),
        ({"manoeuvre": ("doublet:canard:amplitude=0.02",)}, "canard"),
        ({"derivatives": ("Cm_dx",)}, "Cm_dx"),
        ({"accuracy": 0.0}, "accuracy"),
    ],
)
def test_impossible_plans_are_refused(settings: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        exciter.init(AIRCRAFT, ExcitationSettings(**settings))


@pytest.mark.parametrize("kind", ["3211:elevator:amplitude=0.03", "doublet:aileron:amplitude=0.03"])
def test_other_manoeuvres(kind: str) -> None:
    state = exciter.init(AIRCRAFT, ExcitationSettings(manoeuvre=(kind,)))
    exciter.start(state, 0.0)
    flown = np.array([exciter.step(state, t, LEVEL) for t in np.arange(0.0, 5.0, 0.01)])
    assert np.abs(flown).max() == pytest.approx(0.03)


def watched(longest: float = 60.0) -> exciter.ExciterState:
    """Under way since 0 s, with all known once."""
    state = exciter.init(AIRCRAFT, ExcitationSettings(watch=True, longest=longest))
    exciter.start(state, 0.0)
    return state


def test_a_reported_fault_begins_it_at_once_although_the_estimates_are_still_called_valid() -> None:
    """Without excitation estimates stayed valid for 16 s after the monitor had named a lost elevator."""
    state = watched()
    exciter.receive_estimates(state, 5.0, KNOWN)
    assert not state.active
    exciter.receive_faults(state, 30.0, ["elevator: loss of effectiveness"])
    assert state.active
    assert last(state) == "begun again: elevator: loss of effectiveness"
    assert not exciter.receive_estimates(state, 31.4, KNOWN)
    assert exciter.receive_estimates(state, 31.6, KNOWN), "data from before the failure are forgotten"
    exciter.receive_faults(state, 31.7, ["elevator: loss of effectiveness"])
    exciter.receive_estimates(state, 36.0, KNOWN)
    assert not state.active, "the same fault is no news"


def test_a_fault_while_it_is_under_way_has_the_estimates_begun_anew() -> None:
    state = watched()
    exciter.receive_faults(state, 10.0, ["aileron: stuck surface"])
    assert state.active
    assert exciter.receive_estimates(state, 11.6, UNKNOWN)


def test_after_it_gave_up_a_fault_begins_it_again_but_not_after_a_limit_or_a_request() -> None:
    state = watched(longest=5.0)
    exciter.step(state, 5.1, LEVEL)
    assert last(state).startswith("given up")
    exciter.receive_faults(state, 20.0, ["elevator: loss of effectiveness"])
    assert state.active
    exciter.step(state, 20.1, LEVEL._replace(roll=2.0))
    exciter.receive_faults(state, 30.0, ["rudder: loss of effectiveness"])
    assert not state.active


def test_without_watching_a_fault_changes_nothing(state: exciter.ExciterState) -> None:
    exciter.start(state, 0.0)
    exciter.stop(state, 1.0, "stopped")
    exciter.receive_faults(state, 2.0, ["elevator: loss of effectiveness"])
    assert not state.active


def test_what_is_no_longer_valid_while_it_is_under_way_has_the_estimates_begun_anew() -> None:
    """Else data of both aircraft contradict each other, for 8 to 18 s in flight."""
    state = watched()
    nearly = {**KNOWN, "Cn_dr": 0.2}  # valid, not yet accurate: excitation goes on
    exciter.receive_estimates(state, 20.0, nearly)
    lost = {**nearly, "Cm_de": math.inf}
    assert not exciter.receive_estimates(state, 20.1, lost)
    assert not exciter.receive_estimates(state, 21.9, lost)
    assert last(state) == "begun", "a status may flicker"
    assert not exciter.receive_estimates(state, 22.2, lost)
    assert last(state) == "goes on: Cm_de no longer known"
    assert exciter.receive_estimates(state, 23.8, lost)
    assert not any(exciter.receive_estimates(state, 23.9 + 0.1 * k, lost) for k in range(100)), "it takes its time"
