"""The page of ``sysid gap``: the size of the gap, where it lies, its causes, and their correction."""

from __future__ import annotations

from pathlib import Path

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.report.pages.render import render_page
from sysid_node.report.sections.gap import candidates, flight, opening, shape, waterfall
from sysid_node.report.sections.section import Section


def write_gap_report(path: Path, found: Diagnosis) -> None:
    """Write the page as one HTML file."""
    title = f"The simulator against the flight: {found.aircraft.name}"
    path.write_text(render_page(title, SECTIONS, found), encoding="utf-8")


SECTIONS: tuple[Section[Diagnosis], ...] = (
    Section("opening", "", "gap/opening.html.j2", opening.opening),
    Section("channels", "Error before and after the correction", "gap/channels.html.j2", opening.channels),
    Section("where", "Where the gap lies", "gap/where.html.j2", waterfall.where),
    Section("flight", "Measured and simulated", "gap/flight.html.j2", flight.flight),
    Section("candidates", "Possible causes", "gap/candidates.html.j2", candidates.candidates),
    Section("shape", "Shape of the missing force or moment", "gap/shape.html.j2", shape.shape),
)
