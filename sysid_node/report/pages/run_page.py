"""The page of ``sysid replay`` and ``sysid identify``: derivatives, fit, excitation, residuals, faults."""

from __future__ import annotations

from pathlib import Path

from sysid_node.report.pages.render import render_page
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.sections import (
    budget,
    derivatives,
    excitation,
    faults,
    fit,
    history,
    opening,
    rejected,
    residuals,
    settings,
)
from sysid_node.report.sections.section import Section

SECTIONS: tuple[Section[RunResult], ...] = (
    opening.SECTION,
    derivatives.SECTION,
    budget.SECTION,
    history.SECTION,
    fit.SECTION,
    excitation.SECTION,
    residuals.SECTION,
    faults.SECTION,
    rejected.SECTION,
    settings.SECTION,
)


def write_report(path: Path, run: RunResult) -> None:
    """The report of a replay, a live run or a batch identification as one HTML file."""
    path.write_text(render_page(run.heading, SECTIONS, run), encoding="utf-8")
