"""Drift over dates: every significant one as a sentence and a figure."""

from __future__ import annotations

from itertools import groupby
from typing import Any

import numpy as np

from sysid_node.fleet.results import FlightResult
from sysid_node.fleet.statistics.drift import Drift
from sysid_node.fleet.statistics.false_discovery import FALSE_RATE
from sysid_node.fleet.statistics.series import DAY
from sysid_node.fleet.statistics.summary import iso_date
from sysid_node.report.drawing.figures import BLUE, GREY_BAND, INK, VERMILION, Figure, axis, packed
from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.wording.fleet import drift_words, tail_sentence
from sysid_node.report.wording.names import symbol

_MOST = 40  # figures; the map marks every drift


def context(report: FleetReport) -> dict[str, Any]:
    """Sentences by tail, and a figure for each drift."""
    tails = [
        (key[1], tail_sentence(report.tail_name(*key), list(found), report.maintenance(*key)))
        for key, found in groupby(report.drifts, key=lambda d: (d.aircraft, d.tail))
    ]
    flights = {flight.flight: flight for flight in report.results.flights}
    figures = [
        (symbol(d.name), f"{report.tail_name(d.aircraft, d.tail)}: {drift_words(d)}", figure(report, d, flights))
        for d in report.drifts[:_MOST]
    ]
    return {
        "tails": tails,
        "figures": figures,
        "tested": len(report.summary.drifts),
        "rate": f"{100 * FALSE_RATE:.0f}\u202f%",
        "more": max(len(report.drifts) - _MOST, 0),
    }


def figure(report: FleetReport, drift: Drift, flights: dict[str, FlightResult]) -> Figure:
    """One tail's estimates over dates with statistical 95 % intervals, the fitted course, and maintenance."""
    days, values, errors = [], [], []
    for name in drift.flights:
        flight = flights[name]
        place = flight.names.index(drift.name)
        days.append(flight.date.timestamp() / DAY)
        values.append(flight.values[place])
        errors.append(1.96 * np.sqrt(flight.statistical_covariance[place, place]))
    dates = [iso_date(day) for day in days]
    points = {
        "type": "scatter", "mode": "markers", "x": dates, "y": packed(np.array(values)), "name": "estimates",
        "error_y": {"type": "data", "array": packed(np.array(errors)), "thickness": 1.2, "width": 0, "color": BLUE},
        "marker": {"color": BLUE, "size": 6}, "hovertemplate": "%{x|%d %b %Y}: %{y:.4~g}",
    }  # fmt: skip
    shape = "hv" if drift.course.kind == "step" else "linear"
    course = {
        "type": "scatter", "mode": "lines", "x": dates, "y": packed(drift.before + drift.change * drift.course.values),
        "name": "fitted", "line": {"color": VERMILION, "width": 1.6, "shape": shape},
        "hoverinfo": "skip",
    }  # fmt: skip
    shapes = [
        _vertical(iso_date(note.date.timestamp() / DAY)) for note in report.maintenance(drift.aircraft, drift.tail)
    ]
    if drift.course.kind == "step":
        shapes.append(_between(iso_date(drift.course.first), iso_date(drift.course.last)))
    layout = {
        "xaxis": axis("date", type="date", nticks=4),
        "yaxis": axis(drift.name),
        "shapes": shapes,
        "hovermode": "closest",
    }
    tail = report.tail_name(drift.aircraft, drift.tail)
    return Figure(f"{drift.name} of tail {tail} over dates", [points, course], layout, height=240)


def _vertical(date: str) -> dict[str, Any]:
    place = {"type": "line", "yref": "paper", "y0": 0, "y1": 1, "x0": date, "x1": date}
    return {**place, "line": {"color": INK, "dash": "dot", "width": 1.2}}


def _between(first: str, last: str) -> dict[str, Any]:
    place = {"type": "rect", "yref": "paper", "y0": 0, "y1": 1, "x0": first, "x1": last}
    return {**place, "fillcolor": GREY_BAND, "line": {"width": 0}, "layer": "below"}
