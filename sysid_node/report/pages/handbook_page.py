"""The page of ``sysid aircraft``: an aircraft file in a handbook's terms."""

from __future__ import annotations

from pathlib import Path

from sysid_node.dynamics.handbook.handbook import Handbook
from sysid_node.online.types import Estimates
from sysid_node.report.pages.render import render_page
from sysid_node.report.sections import handbook
from sysid_node.report.sections.section import Section

_TABLES = "handbook/tables.html.j2"

SECTIONS: tuple[Section[Handbook], ...] = (
    Section("opening", "", "handbook/opening.html.j2", handbook.opening),
    Section("checks", "What looks unusual", "handbook/unusual.html.j2", handbook.unusual),
    Section("trim", "Level flight", _TABLES, handbook.trim_context),
    Section("modes", "Modes of motion", _TABLES, handbook.mode_context),
    Section("performance", "Performance and control power", _TABLES, handbook.performance_context),
    Section("file", "Servos, delays and tolerances", _TABLES, handbook.file_context),
)


def write_handbook_report(path: Path, book: Handbook, expected: Estimates | str) -> None:
    """Write the page as one HTML file; ``expected`` are the estimates of a usual flight, or why there are none."""
    budget: Section[Handbook] = Section(
        "budget", "Error budget", "handbook/budget.html.j2", lambda _: handbook.budget_context(expected)
    )
    page = render_page(f"Aircraft file of {book.aircraft.name}", (*SECTIONS, budget), book)
    path.write_text(page, encoding="utf-8")
