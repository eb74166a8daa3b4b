"""Flights as CSV: one row per sample, columns named as in ``record.COLUMNS``, and ``t`` in s. Empty: not measured."""

from __future__ import annotations

import csv
import math
import os
import stat
import warnings
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

import numpy as np

from sysid_node.csv_table import write_table
from sysid_node.errors import InputError
from sysid_node.flight import checks
from sysid_node.flight.csv_checks import check_names, check_time, implausible
from sysid_node.flight.record import COLUMNS, Array, FlightRecord

TIME = "t"
SIZE_LIMIT = 2 * 10**9  # bytes: a day at 200 Hz has 1.5e9
LINE_LIMIT = 2**17  # characters
#: Share of samples whose time does not increase from which on the lines are in no order.
WRONG_ORDER = 0.02


def read_csv(path: str | Path, controls: Collection[str] | None = None) -> FlightRecord:
    """The flight in a CSV file; a column with another name is taken as a further control.

    ``controls``: symbols of the aircraft's controls, where it is known; another column is then not used.

    Samples with values that no aircraft measures, and the few whose time does not increase, are left out and counted in
    ``rejected``. Raises InputError that names file and line where a cell is no number, a row is incomplete or time does
    not increase in many lines, and where units are wrong.
    Warns (InputWarning) where a column is missing, or is not used.
    """
    path = Path(path)
    with _naming(path), _lines(path) as lines:
        reader = csv.reader(lines)
        names = [name.strip() for name in next(reader, [])]
        if not names:
            raise InputError(f"is empty: no column {TIME!r}, and no other")
        check_names(names, TIME, controls)
        rows = [(reader.line_num, *_numbers(names, reader.line_num, row)) for row in reader if row]
        if len(rows) < 2:
            raise InputError(f"{len(rows)} samples; at least 2 are needed")
        table, rejected = _in_order(np.array(rows), 1 + names.index(TIME))
        columns = dict(zip(names, np.ascontiguousarray(table.T[1:]), strict=True))
        time = columns.pop(TIME)
        whole = FlightRecord(time, columns, path.stem, rejected=rejected)
        check_time(time)
        if not any(whole.measured(name) for name in COLUMNS):
            raise InputError("no values in any column of a flight; was something recorded?")
        return _plausible(whole)


def _in_order(table: Array, at: int) -> tuple[Array, dict[str, int]]:
    """The rows whose time, in column ``at``, is later than that of all rows before, and how many others by reason.

    The first column holds the lines' numbers. Raises InputError where there are many others.
    """
    time = table[:, at]
    latest = np.maximum.accumulate(np.concatenate([[-np.inf], time[:-1]]))
    later = time > latest
    if later.all():
        return table, {}
    if np.count_nonzero(~later) > WRONG_ORDER * time.size:
        first = int(np.argmin(later))
        raise InputError(
            f"line {table[first, 0]:.0f}: time {time[first]:g} s follows {latest[first]:g} s, and of {time.size} "
            f"samples {np.count_nonzero(~later)} do not increase; sort the lines by time, or make two flights of it"
        )
    twice = int(np.count_nonzero(time[~later] == latest[~later]))
    counts = {checks.DUPLICATE: twice, checks.OUT_OF_ORDER: int(np.count_nonzero(~later)) - twice}
    return table[later], {reason: count for reason, count in counts.items() if count}


def _plausible(flight: FlightRecord) -> FlightRecord:
    """The flight without the samples that no aircraft measures."""
    faults = implausible(flight.time, flight.columns)
    reasons = Counter(reason for reason in faults.tolist() if reason is not None)
    if not reasons:
        return flight
    kept = np.array([reason is None for reason in faults.tolist()], bool)
    if np.count_nonzero(kept) < 2:
        worst, count = reasons.most_common(1)[0]
        raise InputError(f"no two samples are plausible: {count} x {worst}; correct the columns")
    columns = {name: values[kept] for name, values in flight.columns.items()}
    return FlightRecord(flight.time[kept], columns, flight.name, flight.start_ns, {**flight.rejected, **reasons})


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """A context in which errors and warnings about a file's content name the file."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield
    except FileNotFoundError:
        raise InputError(f"{path}: does not exist") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read as CSV: no text in UTF-8; save it in UTF-8") from None
    except (OSError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as CSV: {error}") from error
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    for warning in caught:
        warnings.warn(f"{path}: {warning.message}", warning.category, stacklevel=4)


@contextmanager
def _lines(path: Path) -> Iterator[Iterator[str]]:
    """The lines of a file, up to its size when it was opened. Raises InputError where it is no file, or too large."""
    with path.open(newline="", encoding="utf-8-sig") as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise InputError("is no file but a device or pipe; save it to a file first")
        if status.st_size > SIZE_LIMIT:
            raise InputError(
                f"{status.st_size / 1e9:.1f} GB, over {SIZE_LIMIT / 1e9:g} GB; cut it, or make a bag of it"
            )
        yield _bounded(file, status.st_size)


def _bounded(file: TextIO, size: int) -> Iterator[str]:
    """Lines until ``size`` characters are read: a file that grows faster than it is read ends all the same."""
    read, number = 0, 0
    while read < size and (line := file.readline(LINE_LIMIT)):
        read, number = read + len(line), number + 1
        if len(line) == LINE_LIMIT:
            raise InputError(f"line {number} is longer than {LINE_LIMIT} characters; is it a CSV file?")
        yield line


def write_csv(path: str | Path, flight: FlightRecord) -> None:
    """A flight as CSV, every number to the last bit."""
    columns = [flight.time, *flight.columns.values()]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    write_table(Path(path), [TIME, *flight.columns], rows, blank_nan=True)


def _numbers(names: list[str], line: int, row: list[str]) -> list[float]:
    """One row; an empty cell is NaN."""
    if len(row) != len(names):
        raise InputError(f"line {line} has {len(row)} cells, expected {len(names)}; was the file cut short?")
    with suppress(ValueError):  # an empty cell, or one that is no number: cell by cell
        values = list(map(float, row))
        if all(map(math.isfinite, values)):
            return values
    values = []
    for name, cell in zip(names, row, strict=True):
        try:
            value = float(cell) if cell.strip() else math.nan
        except ValueError:
            value = math.inf
        if math.isinf(value) or (name == TIME and math.isnan(value)):
            raise InputError(f"line {line}, column {name!r}: got {cell!r}, expected a number")
        values.append(value)
    return values
