"""All flights by tail, each with a link to its own report; and the refusals by reason."""

from __future__ import annotations

from typing import Any
from urllib.parse import quote

import numpy as np

from sysid_node.fleet.results import FlightResult, Refusal
from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.wording.numbers import NONE, plural, seconds

_MOST = 20  # names of refused flights in a row


def flights(report: FleetReport) -> dict[str, Any]:
    """Rows by tail, with the share of a flight's estimates that is owed to the fleet."""
    owed: dict[str, list[float]] = {}
    for population in report.summary.populations.values():
        for name, weight in zip(population.series.flight, population.fleet_weight.tolist(), strict=True):
            owed.setdefault(name, []).append(weight)
    of_tail: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for flight in report.results.flights:
        of_tail.setdefault((flight.tail, flight.aircraft), []).append(_row(flight, owed.get(flight.flight, [])))
    tails = [
        (tail, aircraft, plural(len(rows), "flight"), rows, report.maintenance(aircraft, tail))
        for (tail, aircraft), rows in of_tail.items()
    ]
    return {"tails": tails}


def _row(flight: FlightResult, owed: list[float]) -> dict[str, Any]:
    return {
        "date": f"{flight.date:%Y-%m-%d}",
        "flight": flight.flight,
        "link": None if flight.report is None else quote(flight.report),
        "configuration": flight.configuration,
        "data": seconds(flight.data_seconds),
        "remarks": flight.remarks,
        "valid": f"{int(flight.valid.sum())} of {len(flight.names)}",
        "owed": f"{100 * float(np.median(owed)):.0f}\u202f%" if owed else NONE,
        "verdict": str(flight.gap.get("verdict", "")).replace("_", " ") if flight.gap is not None else "",
    }


def refusals(report: FleetReport) -> dict[str, Any]:
    """Refused flights by reason, the most frequent reason first."""
    of_reason: dict[str, list[Refusal]] = {}
    for refusal in report.results.refusals:
        of_reason.setdefault(refusal.reason.removeprefix(f"{refusal.flight}: "), []).append(refusal)
    rows = [
        (reason, len(found), ", ".join(r.flight for r in found[:_MOST]) + (" \u2026" if len(found) > _MOST else ""))
        for reason, found in sorted(of_reason.items(), key=lambda item: -len(item[1]))
    ]
    return {"rows": rows}
