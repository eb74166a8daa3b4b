"""The tables of a fleet, each as CSV and as Parquet, and the content of ``fleet.json``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sysid_node.csv_table import write_table
from sysid_node.fleet.results import FleetResults, FlightResult

#: Columns and their types in Parquet.
Columns = Mapping[str, pa.DataType]

_TEXT, _NUMBER, _FLAG, _DATE = pa.string(), pa.float64(), pa.bool_(), pa.timestamp("ms", tz="UTC")
_OF_FLIGHT: Columns = {"flight": _TEXT, "tail": _TEXT, "aircraft": _TEXT, "configuration": _TEXT, "date": _DATE}
FLIGHTS: Columns = {
    **_OF_FLIGHT,
    "data_seconds": _NUMBER,
    "estimated": pa.int64(),
    "valid": pa.int64(),
    "verdict": _TEXT,
    "report": _TEXT,
    "remarks": _TEXT,
}
ESTIMATES: Columns = {
    **_OF_FLIGHT,
    "derivative": _TEXT,
    "value": _NUMBER,
    "standard_error": _NUMBER,
    "statistical_error": _NUMBER,
    "systematic_error": _NUMBER,
    "valid": _FLAG,
}
COVARIANCES: Columns = {
    "flight": _TEXT,
    "first": _TEXT,
    "second": _TEXT,
    "covariance": _NUMBER,
    "statistical": _NUMBER,
}
CAUSES: Columns = {
    **_OF_FLIGHT,
    "effect": _TEXT,
    "parameter": _TEXT,
    "value": _NUMBER,
    "standard_error": _NUMBER,
    "probability": _NUMBER,
}
REFUSALS: Columns = {"flight": _TEXT, "tail": _TEXT, "aircraft": _TEXT, "date": _DATE, "reason": _TEXT}

_ROWS_A_GROUP = 50_000  # of a Parquet file, which are in memory at a time

Row = Sequence[Any]


def write_tables(folder: Path, results: FleetResults) -> None:
    """Write every table of the results; a table without rows is its header. Raises OSError.

    Covariances are written as Parquet alone: half a million numbers for a thousand flights.
    """
    flights = results.flights
    _write(folder, "flights", FLIGHTS, (_flight_row(flight) for flight in flights))
    _write(folder, "estimates", ESTIMATES, (row for flight in flights for row in _estimate_rows(flight)))
    refusals = ((one.flight, one.tail, one.aircraft, one.date, one.reason) for one in results.refusals)
    _write(folder, "refusals", REFUSALS, refusals)
    _parquet(folder / "covariances.parquet", COVARIANCES, (row for f in flights for row in _covariance_rows(f)))
    if any(flight.gap is not None for flight in flights):
        _write(folder, "causes", CAUSES, (row for flight in flights for row in _cause_rows(flight)))


def document(results: FleetResults, settings: Mapping[str, object]) -> dict[str, Any]:
    """The content of ``fleet.json``: settings, flights, refusals and maintenance notes."""
    return {
        "settings": dict(settings),
        "counts": {"flights": len(results.flights), "refusals": len(results.refusals)},
        "flights": [dict(zip(FLIGHTS, _plain(_flight_row(flight)), strict=True)) for flight in results.flights],
        "refusals": [
            dict(zip(REFUSALS, _plain((o.flight, o.tail, o.aircraft, o.date, o.reason)), strict=True))
            for o in results.refusals
        ],
        "maintenance": [
            {"aircraft": note.aircraft, "tail": note.tail, "date": note.date.isoformat(), "text": note.text}
            for note in results.maintenance
        ],
    }


def _of_flight(flight: FlightResult) -> tuple[Any, ...]:
    return flight.flight, flight.tail, flight.aircraft, flight.configuration, flight.date


def _flight_row(flight: FlightResult) -> Row:
    verdict = None if flight.gap is None else flight.gap["verdict"]
    counts = len(flight.names), int(np.count_nonzero(flight.valid))
    return (*_of_flight(flight), flight.data_seconds, *counts, verdict, flight.report, "; ".join(flight.remarks))


def _estimate_rows(flight: FlightResult) -> Iterator[Row]:
    total, statistical = flight.covariance.diagonal(), flight.statistical_covariance.diagonal()
    errors = (np.sqrt(np.maximum(part, 0.0)).tolist() for part in (total, statistical, total - statistical))
    columns = (flight.names, flight.values.tolist(), *errors, flight.valid.tolist())
    for row in zip(*columns, strict=True):
        yield (*_of_flight(flight), *row)


def _covariance_rows(flight: FlightResult) -> Iterator[Row]:
    """The lower triangle of a flight's covariance."""
    for i, first in enumerate(flight.names):
        rows = flight.covariance[i, : i + 1].tolist(), flight.statistical_covariance[i, : i + 1].tolist()
        for second, total, statistical in zip(flight.names[: i + 1], *rows, strict=True):
            yield flight.flight, first, second, total, statistical


def _cause_rows(flight: FlightResult) -> Iterator[Row]:
    for cause in flight.gap["causes"] if flight.gap is not None else ():
        for name, (value, error) in cause["parameters"].items():
            yield (*_of_flight(flight), cause["effect"], name, value, error, cause["probability"])


def _write(folder: Path, name: str, columns: Columns, rows: Iterable[Row]) -> None:
    """Write a table as CSV and as Parquet, its rows read once."""
    path = folder / f"{name}.csv"
    kept: list[Row] = []

    def passed() -> Iterator[Row]:
        for row in rows:
            kept.append(row)
            yield _plain(row)

    write_table(path, list(columns), passed())
    _parquet(path.with_suffix(".parquet"), columns, kept)


def _parquet(path: Path, columns: Columns, rows: Iterable[Row]) -> None:
    schema, iterator = pa.schema(columns.items()), iter(rows)
    with pq.ParquetWriter(path, schema) as writer:
        while group := list(islice(iterator, _ROWS_A_GROUP)):
            arrays = [
                pa.array(column, kind) for column, kind in zip(zip(*group, strict=True), schema.types, strict=True)
            ]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))


def _plain(row: Row) -> list[Any]:
    """The cells as CSV and JSON have them: dates in ISO 8601."""
    return [cell.isoformat() if hasattr(cell, "isoformat") else cell for cell in row]
