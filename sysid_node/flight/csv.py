"""Flights as CSV: one row per sample, columns named as in ``record.COLUMNS``, and ``t`` in s. Empty: not measured."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from sysid_node.csv_table import write_table
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord

TIME = "t"


def read_csv(path: str | Path) -> FlightRecord:
    """The flight in a CSV file; a column with another name is taken as a further control.

    Raises InputError that names file and line where a cell is no number, a row is incomplete or time does not increase.
    """
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except FileNotFoundError:
        raise InputError(f"{path}: does not exist") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as CSV: {error}") from error
    names = [name.strip() for name in rows[0]] if rows else []
    _check_names(path, names)
    table = np.array([_numbers(path, names, line, row) for line, row in enumerate(rows[1:], start=2) if row])
    if len(table) < 2:
        raise InputError(f"{path}: {len(table)} samples; at least 2 are needed")
    columns = dict(zip(names, np.ascontiguousarray(table.T), strict=True))
    try:
        return FlightRecord(columns.pop(TIME), columns, path.stem)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def write_csv(path: str | Path, flight: FlightRecord) -> None:
    """A flight as CSV, every number to the last bit."""
    columns = [flight.time, *flight.columns.values()]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    write_table(Path(path), [TIME, *flight.columns], rows, blank_nan=True)


def _check_names(path: Path, names: list[str]) -> None:
    if TIME not in names:
        raise InputError(f"{path}: no column {TIME!r} (time in s); the first line must name the columns")
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{path}: column {twice[0]!r} is there twice; leave one out")


def _numbers(path: Path, names: list[str], line: int, row: list[str]) -> list[float]:
    """One row; an empty cell is NaN."""
    if len(row) != len(names):
        raise InputError(f"{path}: line {line} has {len(row)} cells, expected {len(names)}; was the file cut short?")
    values = []
    for name, cell in zip(names, row, strict=True):
        try:
            value = float(cell) if cell.strip() else math.nan
        except ValueError:
            value = math.inf
        if math.isinf(value) or (name == TIME and math.isnan(value)):
            raise InputError(f"{path}: line {line}, column {name!r}: got {cell!r}, expected a number")
        values.append(value)
    return values
