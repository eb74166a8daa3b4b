"""The page of a closed loop: an episode made up here, and what of it is drawn and written."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from synthetic_loop import EVENTS, TIME, episode

from sysid_node.report.pages.closed_loop_page import write_loop


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


@pytest.mark.parametrize(
    ("seconds", "parts"),
    [(20.0, ["whole flight"]), (35.0, ["before the failure", "the first 10 s after it"])],
)
def test_what_a_short_flight_does_not_reach_is_not_told(seconds: float, parts: list[str], tmp_path: Path) -> None:
    count = sum(time < seconds for time in TIME)
    whole = episode(EVENTS[:3])
    errors = {axis: values[:count] for axis, values in whole.errors.items()}
    commanded = {axis: values[:count] for axis, values in whole.commanded.items()}
    short = replace(whole, time=TIME[:count], errors=errors, commanded=commanded)
    assert list(short.summary()["tracking_error"]) == parts
    write_loop(tmp_path, short)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert ("It ended before 30 s, when this failure would have begun" in page) == (seconds < 30.0)
    assert ("At 30 s this failure begins" in page) == (seconds > 30.0)


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
