"""The page of ``sysid loop``: an episode of closed-loop flight, what failed in it, and how well it was flown."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sysid_node.online.types import DerivativeEstimate
from sysid_node.report.drawing.figures import BLUE, MUTED, VERMILION, Figure, line, moment, stretch
from sysid_node.report.drawing.figures import axis as axis_of
from sysid_node.report.pages.render import render_page
from sysid_node.report.sections.section import Section

EXCITER, FAULT_MONITOR = "exciter", "fault_monitor"


class Event(NamedTuple):
    """Who said what, and when (s of the flight)."""

    time: float
    node: str
    text: str


@dataclass(frozen=True)
class ClosedLoopFlight:
    """A flight in closed loop; times in s of the flight, angles in rad."""

    aircraft: str
    failure: str  # the effect that set in; "" = none
    onset: float
    adapted: bool
    time: Sequence[float]
    errors: Mapping[str, Sequence[float]]  # pitch, roll, sideslip from what was asked for
    asked: Mapping[str, Sequence[float]]  # pitch, roll
    estimates: Mapping[str, DerivativeEstimate]
    events: Sequence[Event]
    troubles: Mapping[str, int]  # by topic: how often its messages were late, lost or silent

    def rms(self, axis: str, start: float, stop: float) -> float:
        """Of an error between two times, rad; NaN where there is none."""
        time, errors = np.asarray(self.time), np.asarray(self.errors[axis])
        chosen = errors[(time >= start) & (time < stop) & np.isfinite(errors)]  # not finite: no IMU then
        return float(np.sqrt(np.mean(chosen**2))) if chosen.size else math.nan

    def spans(self, settled: float) -> list[tuple[str, float, float]]:
        """Names and times of the parts of the flight; ``settled`` s after the failure its effects are judged."""
        end = self.time[-1] if self.time else 0.0
        if not self.failure or end < self.onset:
            return [("whole flight", 0.0, end)]
        middle = self.onset + settled
        return [
            ("before the failure", 0.5 * self.onset, self.onset),
            (f"the first {settled:g} s after it", self.onset, min(middle, end)),
            ("from then on", middle, end),
        ]

    def summary(self) -> dict[str, Any]:
        """For ``summary.json``: rms in rad, null where nothing was flown."""
        parts = {
            name: {axis: _known(self.rms(axis, start, stop)) for axis in self.errors}
            for name, start, stop in self.spans(10.0)
        }
        derivatives = {
            name: {"value": _known(d.value), "lower": _known(d.lower), "upper": _known(d.upper), "status": d.status}
            for name, d in self.estimates.items()
        }
        events = [{"time": event.time, "node": event.node, "what": event.text} for event in self.events]
        return {
            "aircraft": self.aircraft,
            "failure": self.failure,
            "adapted": self.adapted,
            "tracking_error": parts,
            "derivatives": derivatives,
            "events": events,
            "message_troubles": dict(self.troubles),
        }

    @property
    def excited(self) -> list[tuple[float, float]]:
        """Spans (s) in which the exciter moved the surfaces."""
        spans, begun = [], math.nan
        for event in self.events:
            if event.node != EXCITER:
                continue
            if event.text.startswith("begun"):
                begun = event.time
            elif event.text.startswith(("known", "aborted", "stopped")) and math.isfinite(begun):
                spans.append((begun, event.time))
                begun = math.nan
        return [*spans, (begun, self.time[-1])] if math.isfinite(begun) and self.time else spans

    @property
    def alarms(self) -> list[Event]:
        """Where the fault monitor began to speak of a fault."""
        return [event for event in self.events if event.node == FAULT_MONITOR and ": " in event.text]


def write_loop(folder: Path, episode: ClosedLoopFlight) -> None:
    """``report.html`` in the folder."""
    page = render_page(f"{episode.aircraft} in closed loop", SECTIONS, episode)
    (folder / "report.html").write_text(page, encoding="utf-8")


def _context(episode: ClosedLoopFlight) -> dict[str, Any]:
    flown = [_flown(episode, axis) for axis in episode.asked]
    errors = [
        _figure(episode, f"{axis}: tracking error, deg", [(axis, values, BLUE)])
        for axis, values in episode.errors.items()
    ]
    rows = [
        (name, [math.degrees(episode.rms(axis, start, stop)) for axis in episode.errors])
        for name, start, stop in episode.spans(10.0)
    ]
    return {"episode": episode, "figures": [*flown, *errors], "rows": rows, "axes": list(episode.errors)}


def _flown(episode: ClosedLoopFlight, axis: str) -> Figure:
    """What was asked for and what was flown."""
    asked = np.asarray(episode.asked[axis], dtype=float)
    flown = asked + np.asarray(episode.errors[axis], dtype=float)
    return _figure(
        episode,
        f"{axis}: flown (blue) and commanded (grey), deg",
        [("flown", flown, BLUE), ("commanded", asked, MUTED)],
    )


def _figure(episode: ClosedLoopFlight, label: str, curves: Sequence[tuple[str, Any, str]]) -> Figure:
    """Angles (rad) over time; with excitation, failure and alarms."""
    time = np.asarray(episode.time, dtype=float)
    thin = max(time.size // 3000, 1)
    lines = [
        line(time[::thin], np.rad2deg(np.asarray(values, dtype=float)[::thin]), name, colour=colour)
        for name, values, colour in curves
    ]
    shapes = [stretch(start, stop) for start, stop in episode.excited]
    if episode.failure and time.size and time[-1] > episode.onset:
        shapes.append(moment(episode.onset))
    shapes += [moment(alarm.time, VERMILION) for alarm in episode.alarms]
    return Figure(label, lines, {"shapes": shapes, "xaxis": axis_of("time, s")}, height=200)


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


SECTIONS: tuple[Section[ClosedLoopFlight], ...] = (Section("loop", "", "loop.html.j2", _context),)
