"""The tables of a fleet, as CSV and, where pyarrow is installed, as Parquet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from sysid_node.csv_table import write_table
from sysid_node.fleet.statistics.summary import FleetSummary, iso_date
from sysid_node.report.results.fleet_report import FleetReport

Row = tuple[object, ...]
Table = tuple[Sequence[str], list[Row]]


def write_fleet_tables(folder: Path, report: FleetReport) -> None:
    """Write what the flights tell together: five tables, each as .csv and .parquet."""
    summary = report.summary
    for name, (head, rows) in {
        "fleet_weights": _weights(summary),
        "population": _population(summary),
        "tails": _tails(summary),
        "drift": _drift(summary),
        "pooled_causes": _causes(summary),
    }.items():
        write_table(folder / f"{name}.csv", head, rows, blank_nan=True)
        _write_parquet(folder / f"{name}.parquet", head, rows)


def _write_parquet(path: Path, head: Sequence[str], rows: Sequence[Row]) -> None:
    try:
        import pyarrow  # noqa: PLC0415  # an extra; the CSV holds the same
        from pyarrow import parquet  # noqa: PLC0415
    except ImportError:
        return
    columns = [[_cell(value) for value in column] for column in zip(*rows, strict=True)] or [[] for _ in head]
    parquet.write_table(pyarrow.table(dict(zip(head, columns, strict=True))), path)


def _cell(value: object) -> object:
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and math.isnan(value) else value


def _weights(summary: FleetSummary) -> Table:
    """The weight that the fleet's other flights have in each flight's combined estimate."""
    rows: list[Row] = [
        (flight, *key, weight)
        for key, p in summary.populations.items()
        for flight, weight in zip(p.series.flight, p.fleet_weight.tolist(), strict=True)
    ]
    return ("flight", "aircraft", "derivative", "weight"), rows


def _population(summary: FleetSummary) -> Table:
    head = (
        "aircraft", "derivative", "flights", "tails", "mean", "standard_error", "lower", "upper", "scatter_of_tails",
        "scatter_of_tails_lower", "scatter_of_tails_upper", "scatter_of_flights", "scatter_of_flights_lower",
        "scatter_of_flights_upper", "file", "differs",
    )  # fmt: skip
    rows: list[Row] = []
    for key, p in summary.populations.items():
        fit, difference = p.fit, summary.differences.get(key)
        file = (math.nan, "") if difference is None else (difference.file, str(difference.significant).lower())
        scatters = chain.from_iterable((s.value, s.lower, s.upper) for s in (fit.tails, fit.flights))
        mean = fit.mean, fit.total_error, fit.lower, fit.upper
        rows.append((*key, p.series.count, len(p.series.tails), *mean, *scatters, *file))
    return head, rows


def _tails(summary: FleetSummary) -> Table:
    """Each tail's derivative: its own mean, its estimate with the fleet, and how far it lies from the others."""
    head = (
        "aircraft", "tail", "derivative", "flights", "own", "own_error", "level", "level_error", "systematic_error",
        "shrinkage", "distance", "distance_error", "adjusted_p", "stands_out", "next_value", "next_tolerance",
    )  # fmt: skip
    rows: list[Row] = []
    for (aircraft, name), p in summary.populations.items():
        fit = p.fit
        for j, tail in enumerate(p.series.tails):
            found = summary.deviations.get((aircraft, tail, name))
            apart: Row = (math.nan, math.nan, math.nan, "")
            if found is not None:
                apart = (found.distance, found.error, found.adjusted_p, str(found.significant).lower())
            numbers = (
                fit.by_tail.own[j],
                fit.by_tail.own_error[j],
                fit.by_tail.level[j],
                fit.by_tail.level_error[j],
                fit.by_tail.systematic[j],
                fit.by_tail.shrinkage[j],
            )
            prior = summary.priors[aircraft, tail][name]
            who = aircraft, tail, name, prior.flights
            rows.append((*who, *(float(x) for x in numbers), *apart, prior.value, prior.tolerance))
    return head, rows


def _drift(summary: FleetSummary) -> Table:
    head = (
        "aircraft", "tail", "derivative", "kind", "change", "error", "before", "since", "first", "last",
        "configuration", "p_value", "adjusted_p", "significant",
    )  # fmt: skip
    rows: list[Row] = [
        (
            d.aircraft, d.tail, d.name, d.course.kind, d.change, d.error, d.before,
            *map(iso_date, (d.course.since, d.course.first, d.course.last)), d.course.configuration,
            d.p_value, d.adjusted_p, str(d.significant).lower(),
        )
        for d in summary.drifts.values()
    ]  # fmt: skip
    return head, rows


def _causes(summary: FleetSummary) -> Table:
    """Each tail's probability of each cause, and the size of each parameter with the type's and the own part."""
    head = (
        "aircraft", "cause", "account", "shared", "tail", "probability", "own", "named_in", "diagnosed", "since",
        "parameter", "size", "lower", "upper", "shared_size", "own_size",
    )  # fmt: skip
    rows: list[Row] = []
    for cause in summary.causes:
        for tail in cause.tails:
            since = "" if tail.since is None else iso_date(tail.since)
            who = (cause.aircraft, cause.label, cause.account, cause.shared, tail.tail, tail.probability, tail.own)
            for key in tail.sizes or ("",):
                size, shared, own = (sizes.get(key) for sizes in (tail.sizes, tail.shared_sizes, tail.own_sizes))
                total = (math.nan, math.nan, math.nan) if size is None else (size.value, size.lower, size.upper)
                parts = (math.nan if part is None else part.value for part in (shared, own))
                rows.append((*who, tail.found, tail.flights, since, key, *total, *parts))
    return head, rows
