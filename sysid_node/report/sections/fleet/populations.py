"""Derivatives of each type: mean, scatters and difference from the file, with forest plots and estimates over dates."""

from __future__ import annotations

from typing import Any

import numpy as np

from sysid_node.fleet.statistics.population import Population
from sysid_node.fleet.statistics.random_effects import Scatter
from sysid_node.fleet.statistics.summary import iso_date
from sysid_node.report.drawing.figures import (
    BLUE,
    BLUE_BAND,
    GREEN,
    MUTED,
    PURPLE,
    VERMILION,
    Figure,
    Trace,
    axis,
    packed,
)
from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.wording.names import short_meaning, symbol
from sysid_node.report.wording.numbers import NONE, number, with_interval

_TAIL_HEIGHT = 17  # pixels a tail in a forest plot
_MOST_TAILS = 60  # in one forest plot; beyond them those nearest to the mean are left out
_COLOURS = (VERMILION, BLUE, GREEN, PURPLE)
_NORMAL_95 = 1.96
#: Share of its interval's upper end below which a scatter is written as none: the two digits of that end hide it.
_TOLD = 0.005


def context(report: FleetReport) -> dict[str, Any]:
    """A table and the figures of each type."""
    return {
        "types": [
            (aircraft, [_row(report, population) for population in report.populations(aircraft)])
            for aircraft in report.summary.tails
        ]
    }


def _row(report: FleetReport, population: Population) -> dict[str, Any]:
    fit, series = population.fit, population.series
    difference = report.summary.differences.get(population.key)
    size = abs(fit.mean) if fit.mean else 1.0
    return {
        "symbol": symbol(series.name),
        "meaning": short_meaning(series.name),
        "flights": series.count,
        "mean": with_interval(fit.mean, fit.upper - fit.mean),
        "tails": _scatter(fit.tails, size, series.name),
        "within": _scatter(fit.flights, size, series.name),
        "owed": f"{100 * float(np.median(population.fleet_weight)):.0f}\u202f%",
        "file": NONE if difference is None else number(difference.file),
        "differs": "" if difference is None else _difference(difference.difference, difference.file, series.name),
        "significant": difference is not None and difference.significant,
        "forest": forest(population),
        "dates": over_dates(report, population),
    }


def _scatter(scatter: Scatter, size: float, name: str) -> str:
    """A standard deviation in percent of the mean, or in the derivative's unit for an offset, with its interval."""
    if np.isnan(scatter.value):
        return NONE
    scale, unit = (1.0, "") if name.endswith("_0") else (100.0 / size, "\u202f%")
    least = _TOLD * scatter.upper if np.isfinite(scatter.upper) else 0.0
    found = (x if x >= least else 0.0 for x in (scatter.value, scatter.lower, scatter.upper))
    value, lower, upper = (number(scale * x, 2) for x in found)
    return f"{value}{unit} ({lower} to {upper})"


def _difference(difference: float, file: float, name: str) -> str:
    if not file or name.endswith("_0"):
        return number(difference, 2)
    return f"{number(100 * difference / file, 2)}\u202f%"


def forest(population: Population) -> Figure:
    """Each tail's own mean and its estimate drawn towards the type's mean, with 95 % intervals."""
    fit, tails = population.fit, np.array(population.series.tails)
    order = np.argsort(fit.by_tail.level)
    if order.size > _MOST_TAILS:
        far = np.argsort(-np.abs(fit.by_tail.level - fit.mean))[:_MOST_TAILS]
        order = order[np.isin(order, far)]
    names = tails[order].tolist()
    own = _interval(
        fit.by_tail.own[order], names, fit.by_tail.own_error[order], "the tail's flights alone", MUTED, "circle-open"
    )
    level = _interval(fit.by_tail.level[order], names, fit.by_tail.level_error[order], "with the fleet", BLUE, "circle")
    band = {
        "type": "rect", "yref": "paper", "y0": 0, "y1": 1, "x0": fit.lower, "x1": fit.upper,
        "fillcolor": BLUE_BAND, "line": {"width": 0}, "layer": "below",
    }  # fmt: skip
    layout = {
        "shapes": [band],
        "xaxis": axis(population.series.name),
        "yaxis": axis("", type="category", dtick=1, tickfont={"size": 10}),
        "hovermode": "closest",
        "margin": {"l": 80, "r": 10, "t": 10, "b": 40},
    }
    label = f"{population.series.name} of {population.series.aircraft}: tails' means and the type's"
    return Figure(label, [own, level], layout, height=70 + _TAIL_HEIGHT * max(len(names), 4))


def _interval(x: Any, y: list[str], error: Any, name: str, colour: str, mark: str) -> Trace:
    return {
        "type": "scatter", "mode": "markers", "x": packed(x), "y": y, "name": name,
        "error_x": {"type": "data", "array": packed(_NORMAL_95 * error), "thickness": 1.2, "width": 0, "color": colour},
        "marker": {"color": colour, "size": 6, "symbol": mark}, "hovertemplate": "%{y}: %{x:.4~g}",
    }  # fmt: skip


def over_dates(report: FleetReport, population: Population) -> Figure:
    """All flights' estimates over their dates; tails that drift or stand out in colour."""
    series = population.series
    marked = [tail for tail in series.tails if _stands_out(report, series.aircraft, tail, series.name)][: len(_COLOURS)]
    places = [series.tails.index(tail) for tail in marked]
    values = _measured(report, population)
    rest = ~np.isin(series.tail, places)
    days = [iso_date(day) for day in series.day]
    traces = [
        _points([d for d, k in zip(days, rest, strict=True) if k], values[rest], "other tails", MUTED, line=False)
    ]
    for tail, place, colour in zip(marked, places, _COLOURS, strict=False):
        rows = np.flatnonzero(series.tail == place)
        traces.append(_points([days[row] for row in rows], values[rows], tail, colour, line=True))
    layout = {
        "xaxis": axis("date", type="date", nticks=4), "yaxis": axis(series.name), "hovermode": "closest",
        "showlegend": bool(marked),
    }  # fmt: skip
    return Figure(f"{series.name} of {series.aircraft} over the dates of the flights", traces, layout, height=260)


def _stands_out(report: FleetReport, aircraft: str, tail: str, name: str) -> bool:
    key = aircraft, tail, name
    drift, deviation = report.summary.drifts.get(key), report.summary.deviations.get(key)
    return bool((drift and drift.significant) or (deviation and deviation.significant))


def _measured(report: FleetReport, population: Population) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The estimates (N,) as they were, drift included."""
    series = population.series
    values = series.value.copy()
    for j, tail in enumerate(series.tails):
        drift = report.summary.drifts.get((series.aircraft, tail, series.name))
        if drift is not None and drift.significant:
            values[series.tail == j] += drift.change * drift.course.values
    return values


def _points(days: list[str], values: Any, name: str, colour: str, *, line: bool) -> Trace:
    return {
        "type": "scatter", "mode": "lines+markers" if line else "markers", "x": days, "y": packed(values), "name": name,
        "line": {"color": colour, "width": 1.2}, "marker": {"color": colour, "size": 6 if line else 4},
        "opacity": 1.0 if line else 0.5, "hovertemplate": "%{x|%d %b}: %{y:.4~g}",
    }  # fmt: skip
