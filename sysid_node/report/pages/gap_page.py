"""The page of ``sysid gap``: the size of the gap, where it lies, its causes, and their correction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.reflying import InSimulator
from sysid_node.report.pages.render import render_page
from sysid_node.report.sections.gap import candidates, flight, opening, reflown, shape, waterfall
from sysid_node.report.sections.section import Section


def write_gap_report(
    path: Path, found: Diagnosis, flown: InSimulator | None = None, warnings: Sequence[str] = ()
) -> None:
    """Write the page as one HTML file.

    ``flown`` is what the correction does in the user's simulator; ``warnings`` are those about the flights.
    """
    title = f"The simulator against the flight: {found.aircraft.name}"
    sections = [Section("opening", "", "gap/opening.html.j2", _opening(warnings)), *SECTIONS]
    if flown is not None:
        there = Section("reflown", f"Flown in {flown.simulator.label}", "gap/reflown.html.j2", _reflown(flown))
        sections.insert(_AFTER_CHANNELS, there)
    path.write_text(render_page(title, sections, found), encoding="utf-8")


def _opening(warnings: Sequence[str]) -> Callable[[Diagnosis], Mapping[str, Any]]:
    return lambda found: opening.opening(found, warnings)


def _reflown(flown: InSimulator) -> Callable[[Diagnosis], Mapping[str, Any]]:
    return lambda found: reflown.reflown(found, flown)


#: Place of the section about the user's simulator.
_AFTER_CHANNELS = 2


SECTIONS: tuple[Section[Diagnosis], ...] = (
    Section("channels", "Error before and after the correction", "gap/channels.html.j2", opening.channels),
    Section("where", "Where the gap lies", "gap/where.html.j2", waterfall.where),
    Section("flight", "Measured and simulated", "gap/flight.html.j2", flight.flight),
    Section("candidates", "Possible causes", "gap/candidates.html.j2", candidates.candidates),
    Section("shape", "Shape of the missing force or moment", "gap/shape.html.j2", shape.shape),
)
