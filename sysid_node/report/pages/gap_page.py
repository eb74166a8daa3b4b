"""The page of ``sysid gap``: how far off the simulator is, where, why, and how far that can be mended."""

from __future__ import annotations

from pathlib import Path

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.report.pages.render import render_page
from sysid_node.report.sections.gap import panels as gap
from sysid_node.report.sections.gap.paragraph import paragraph
from sysid_node.report.sections.section import Section


def write_gap_report(path: Path, found: Diagnosis) -> None:
    """The page as one HTML file."""
    title = f"The simulator against the flight: {found.aircraft.name}"
    path.write_text(render_page(title, SECTIONS, found), encoding="utf-8")


def opening_text(found: Diagnosis) -> str:
    """The paragraph that a pilot reads first."""
    return paragraph(found)


SECTIONS: tuple[Section[Diagnosis], ...] = (
    Section("opening", "", "gap_opening.html.j2", gap.opening),
    Section("channels", "How far off, before and after", "gap_channels.html.j2", gap.channels),
    Section("where", "Where the gap lies", "gap_where.html.j2", gap.where),
    Section("flight", "Measured and simulated", "gap_flight.html.j2", gap.flight),
    Section("candidates", "What could cause it", "gap_candidates.html.j2", gap.candidates),
    Section("shape", "The shape of what is missing", "gap_shape.html.j2", gap.shape),
)
