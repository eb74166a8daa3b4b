"""The page of a closed loop: an episode made up here, and what of it is drawn and written."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from sysid_node.report.pages.closed_loop_page import write_loop
from sysid_node.report.results.closed_loop import ClosedLoopFlight, Event

TIME = np.arange(0.0, 60.0, 0.01).tolist()
EVENTS = (
    Event(3.2, "exciter", "begun"),
    Event(5.0, "adaptive_controller", "pitch: adapted; lateral: adapted"),
    Event(8.0, "exciter", "known after 4.8 s"),
    Event(21.0, "fault_monitor", "nothing has failed"),
    Event(30.0, "loop", "control_effectiveness_loss:elevator=0.6"),
    Event(31.5, "fault_monitor", "elevator: loss of effectiveness"),
    Event(31.5, "exciter", "begun again: Cm_de no longer known"),
    Event(33.5, "exciter", "estimates begun anew"),
)


def episode(events: tuple[Event, ...] = EVENTS, failure: str = EVENTS[4].text) -> ClosedLoopFlight:
    """Pitch is off by 0.01 rad until 30 s and by 0.02 rad after; a tenth of the rows is not measured."""
    off = [math.nan if i % 10 == 0 else 0.01 if t < 30.0 else 0.02 for i, t in enumerate(TIME)]
    errors = {"pitch": off, "roll": [0.0] * len(TIME), "sideslip": [0.0] * len(TIME)}
    commanded = {"pitch": [0.08] * len(TIME), "roll": [0.2] * len(TIME)}
    return ClosedLoopFlight("cdrw", failure, 30.0, True, TIME, errors, commanded, {}, events, {"imu/data": 3})


def test_excitation_and_alarms_are_told_from_the_events() -> None:
    assert episode().excited == [(3.2, 8.0), (31.5, TIME[-1])]
    assert [alarm.time for alarm in episode().alarms] == [31.5]
    assert episode(EVENTS[3:4]).excited == episode(EVENTS[3:4]).alarms == []


def test_errors_before_and_after_the_failure() -> None:
    summary = episode().summary()
    assert summary["tracking_error"]["before the failure"]["pitch"] == pytest.approx(0.01)
    assert summary["tracking_error"]["from then on"]["pitch"] == pytest.approx(0.02)
    assert summary["events"][0] == {"time": 3.2, "node": "exciter", "what": "begun"}
    json.dumps(summary, allow_nan=False)


def test_the_page_shows_what_happened(tmp_path: Path) -> None:
    write_loop(tmp_path, episode())
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count('class="plot"') == 5
    assert "<td>fault_monitor</td><td>elevator: loss of effectiveness</td>" in page
    assert "<code>imu/data</code> 3." in page
    assert "the failure begins" in page
    write_loop(tmp_path, episode(EVENTS[:4], failure=""))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "No failure was simulated." in page
    assert "Dotted" not in page
