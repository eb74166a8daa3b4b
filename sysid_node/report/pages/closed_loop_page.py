"""The page of ``sysid loop``: a closed-loop flight, its failure, and its tracking errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.report.drawing.figures import BLUE, MUTED, VERMILION, Figure, line, moment, stretch
from sysid_node.report.drawing.figures import axis as axis_of
from sysid_node.report.pages.render import render_page
from sysid_node.report.results.closed_loop import ClosedLoopFlight
from sysid_node.report.sections.section import Section


def write_loop(folder: Path, episode: ClosedLoopFlight) -> None:
    """Write ``report.html`` into the folder."""
    page = render_page(f"{episode.aircraft} in closed loop", SECTIONS, episode)
    (folder / "report.html").write_text(page, encoding="utf-8")


def _context(episode: ClosedLoopFlight) -> dict[str, Any]:
    flown = [_flown(episode, axis) for axis in episode.commanded]
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
    """An angle as flown and as commanded."""
    commanded = np.asarray(episode.commanded[axis], dtype=float)
    flown = commanded + np.asarray(episode.errors[axis], dtype=float)
    return _figure(
        episode,
        f"{axis}: flown (blue) and commanded (grey), deg",
        [("flown", flown, BLUE), ("commanded", commanded, MUTED)],
    )


def _figure(episode: ClosedLoopFlight, label: str, curves: Sequence[tuple[str, Any, str]]) -> Figure:
    """Angles (rad) against time, with excitation, failure and fault reports marked."""
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


SECTIONS: tuple[Section[ClosedLoopFlight], ...] = (Section("loop", "", "loop.html.j2", _context),)
