"""The page of ``sysid fleet``: what many flights tell together."""

from __future__ import annotations

from pathlib import Path

from sysid_node.report.pages.render import render_page
from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.sections.fleet import causes, drift, flights, opening, populations, tail_map
from sysid_node.report.sections.section import Section

SECTIONS: tuple[Section[FleetReport], ...] = (
    Section("opening", "", "fleet/opening.html.j2", opening.opening),
    Section("map", "Tails by derivatives", "fleet/tail_map.html.j2", tail_map.context),
    Section("drift", "Changes over the dates", "fleet/drift.html.j2", drift.context),
    Section("causes", "Simulator or aircraft", "fleet/causes.html.j2", causes.context),
    Section("populations", "Derivatives of the types", "fleet/populations.html.j2", populations.context),
    Section("refusals", "Refused flights", "fleet/refusals.html.j2", flights.refusals),
    Section("flights", "Flights", "fleet/flights.html.j2", flights.flights),
)


def write_fleet_report(path: Path, report: FleetReport) -> None:
    """Write the page as one HTML file."""
    path.write_text(render_page("What the fleet tells", SECTIONS, report), encoding="utf-8")
