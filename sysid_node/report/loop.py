"""The page of ``sysid loop``: an episode of closed-loop flight, what failed in it, and how well it was flown."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.online.types import DerivativeEstimate
from sysid_node.report.figures import BLUE, Figure, line
from sysid_node.report.page import render_page
from sysid_node.report.sections import Section


@dataclass(frozen=True)
class Episode:
    """A flight in closed loop; times in s of the flight, errors in rad."""

    aircraft: str
    failure: str  # the effect that set in; "" = none
    onset: float
    adapted: bool
    time: Sequence[float]
    errors: Mapping[str, Sequence[float]]  # pitch, roll, sideslip from what was asked for
    estimates: Mapping[str, DerivativeEstimate]
    events: Sequence[tuple[float, str]]

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
        events = [{"time": time, "what": text} for time, text in self.events]
        return {
            "aircraft": self.aircraft,
            "failure": self.failure,
            "adapted": self.adapted,
            "tracking_error": parts,
            "derivatives": derivatives,
            "events": events,
        }


def write_loop(folder: Path, episode: Episode) -> None:
    """``report.html`` in the folder."""
    page = render_page(f"{episode.aircraft} in closed loop", SECTIONS, episode)
    (folder / "report.html").write_text(page, encoding="utf-8")


def _context(episode: Episode) -> dict[str, Any]:
    time = np.asarray(episode.time, dtype=float)
    thin = max(time.size // 3000, 1)
    figures = [
        Figure(
            f"{axis} error, deg",
            [line(time[::thin], np.rad2deg(np.asarray(errors, dtype=float)[::thin]), axis, colour=BLUE)],
        )
        for axis, errors in episode.errors.items()
    ]
    rows = [
        (name, [math.degrees(episode.rms(axis, start, stop)) for axis in episode.errors])
        for name, start, stop in episode.spans(10.0)
    ]
    return {"episode": episode, "figures": figures, "rows": rows, "axes": list(episode.errors)}


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


SECTIONS: tuple[Section[Episode], ...] = (Section("loop", "", "loop.html.j2", _context),)
