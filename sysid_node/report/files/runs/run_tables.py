"""The CSV tables of a run, written and read back without loss: numbers to the last bit, an empty cell is NaN.

========================  ==============================================================================
``derivatives.csv``       final: name, value, standard_error, lower, upper, valid, status, statistical_error,
                          systematic_error, prior, prior_tolerance, truth, truth_since (where it changed in flight)
``estimates.csv``         over time: time, name, value, standard_error, lower, upper, valid, status,
                          statistical_error, systematic_error
``fits.csv``              over time: time, coefficient, r_squared, residual_std, degrees_of_freedom, samples
``signals.csv``           the aligned record (thinned where it is long): time, one column per signal
``spectra.csv``           frequency, ``input_<control>``, ``measured_<coefficient>``, ``residual_<coefficient>``
``responses.csv``         name, unit, time, measured, modelled
========================  ==============================================================================

SI and radians; time in s from the start of the record. A table without content is not written.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from sysid_node.csv_table import Row, write_table
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality
from sysid_node.report.results.run_result import Prior, References
from sysid_node.report.results.signals import Response, Spectra

_PARTS = ("statistical_error", "systematic_error")
ESTIMATE_COLUMNS = ("name", "value", "standard_error", "lower", "upper", "valid", "status", *_PARTS)
FIT_COLUMNS = ("coefficient", "r_squared", "residual_std", "degrees_of_freedom", "samples")
REFERENCE_COLUMNS = ("prior", "prior_tolerance", "truth", "truth_since")
RESPONSE_COLUMNS = ("name", "unit", "time", "measured", "modelled")

T = TypeVar("T")


def write_derivatives(path: Path, derivatives: Iterable[DerivativeEstimate], references: References) -> None:
    """The final estimates, each with its prior and its true value."""
    prior = references.prior
    rows = (
        (
            *_estimate_cells(d),
            prior[d.name].value if d.name in prior else math.nan,
            prior[d.name].tolerance if d.name in prior else math.nan,
            references.truth.get(d.name, math.nan),
            references.truth_since.get(d.name, math.nan),
        )
        for d in derivatives
    )
    _write(path, ESTIMATE_COLUMNS + REFERENCE_COLUMNS, rows)


def read_references(path: Path) -> References:
    """What ``write_derivatives`` wrote of the references; empty where there is no such file."""
    prior: dict[str, Prior] = {}
    truth: dict[str, float] = {}
    since: dict[str, float] = {}
    columns = ESTIMATE_COLUMNS + REFERENCE_COLUMNS
    for name, (value, tolerance, true, time) in _read(path, columns, lambda r: (r[0], [_number(c) for c in r[-4:]])):
        if not math.isnan(value):
            prior[name] = Prior(value, tolerance)
        if not math.isnan(true):
            truth[name] = true
        if not math.isnan(time):
            since[name] = time
    return References(prior, truth, since)


def write_estimates(path: Path, history: Iterable[Estimates]) -> None:
    """All estimates over time, one row a derivative and time."""
    rows = ((e.time, *_estimate_cells(d)) for e in history for d in e.derivatives.values())
    _write(path, ("time", *ESTIMATE_COLUMNS), rows)


def write_fits(path: Path, history: Iterable[Estimates]) -> None:
    """The quality of fit over time, one row a coefficient and time."""
    rows = (
        (e.time, f.coefficient, f.r_squared, f.residual_std, f.degrees_of_freedom, f.samples)
        for e in history
        for f in e.fits.values()
    )
    _write(path, ("time", *FIT_COLUMNS), rows)


def read_history(estimates: Path, fits: Path) -> list[Estimates]:
    """What ``write_estimates`` and ``write_fits`` wrote, by increasing time; empty where there are no such files."""
    derivatives: dict[float, dict[str, DerivativeEstimate]] = {}
    for time, derivative in _read(estimates, ("time", *ESTIMATE_COLUMNS), _estimate):
        derivatives.setdefault(time, {})[derivative.name] = derivative
    qualities: dict[float, dict[str, FitQuality]] = {}
    for time, fit in _read(fits, ("time", *FIT_COLUMNS), _fit):
        qualities.setdefault(time, {})[fit.coefficient] = fit
    times = sorted(derivatives.keys() | qualities.keys())
    return [Estimates(time, derivatives.get(time, {}), qualities.get(time, {})) for time in times]


def write_signals(path: Path, flight: FlightRecord | None) -> None:
    """The aligned record, a column per signal."""
    columns = {} if flight is None else dict(flight.columns)
    time = np.empty(0) if flight is None else flight.time
    _write(path, ("time", *columns), zip(time.tolist(), *(c.tolist() for c in columns.values()), strict=True))


def read_signals(path: Path) -> FlightRecord | None:
    """What ``write_signals`` wrote; None where there is no such file."""
    columns = read_columns(path, "time")
    if not columns:
        return None
    try:
        return FlightRecord(columns.pop("time"), columns)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def write_spectra(path: Path, spectra: Spectra | None) -> None:
    """Spectra of inputs, of measured coefficients and of what the model leaves."""
    if spectra is None:
        return
    kinds = (("input", spectra.inputs), ("measured", spectra.measured), ("residual", spectra.residuals))
    columns = {f"{kind}_{name}": values for kind, group in kinds for name, values in group.items()}
    rows = zip(spectra.frequency.tolist(), *(c.tolist() for c in columns.values()), strict=True)
    _write(path, ("frequency", *columns), rows)


def read_spectra(path: Path) -> Spectra | None:
    """What ``write_spectra`` wrote; None where there is no such file."""
    columns = read_columns(path, "frequency")
    if not columns:
        return None
    groups: dict[str, dict[str, Array]] = {"input": {}, "measured": {}, "residual": {}}
    frequency = columns.pop("frequency")
    for column, values in columns.items():
        kind, _, name = column.partition("_")
        if kind not in groups:
            raise InputError(f"{path.name}: column {column!r}; expected input_, measured_ or residual_ and a name")
        groups[kind][name] = values
    return Spectra(frequency, groups["input"], groups["measured"], groups["residual"])


def write_responses(path: Path, responses: Mapping[str, Response]) -> None:
    """Measured and modelled quantities over time."""
    rows = (
        (name, r.unit, *values)
        for name, r in responses.items()
        for values in zip(r.time.tolist(), r.measured.tolist(), r.modelled.tolist(), strict=True)
    )
    _write(path, RESPONSE_COLUMNS, rows)


def read_responses(path: Path) -> dict[str, Response]:
    """What ``write_responses`` wrote; empty where there is no such file."""
    units: dict[str, str] = {}
    values: dict[str, list[list[float]]] = {}
    for name, unit, numbers in _read(path, RESPONSE_COLUMNS, lambda r: (r[0], r[1], [_number(cell) for cell in r[2:]])):
        units[name] = unit
        values.setdefault(name, []).append(numbers)
    return {name: Response(units[name], *np.array(rows).T) for name, rows in values.items()}


def _estimate_cells(d: DerivativeEstimate) -> Row:
    parts = d.statistical_error, d.systematic_error
    return (d.name, d.value, d.standard_error, d.lower, d.upper, "true" if d.valid else "false", d.status, *parts)


def _estimate(row: list[str]) -> tuple[float, DerivativeEstimate]:
    time, name, value, standard_error, lower, upper, valid, status, *parts = row
    if valid not in ("true", "false"):
        raise ValueError(f"valid is {valid!r}, expected true or false")
    error, low, high = _number(standard_error), _number(lower), _number(upper)
    statistical, systematic = (_number(part) for part in parts)
    estimate = DerivativeEstimate(
        name, _number(value), error, low, high, valid == "true", status, statistical, systematic
    )
    return _number(time), estimate


def _fit(row: list[str]) -> tuple[float, FitQuality]:
    time, coefficient, r_squared, residual_std, freedom, samples = row
    quality = FitQuality(coefficient, _number(r_squared), _number(residual_std), _number(freedom), int(samples))
    return _number(time), quality


def _number(cell: str) -> float:
    return float(cell) if cell else math.nan


def _write(path: Path, header: Sequence[str], rows: Iterable[Row]) -> None:
    write_table(path, header, rows, blank_nan=True, keep_empty=False)


def _read(path: Path, header: Sequence[str], parse: Callable[[list[str]], T]) -> Iterator[T]:
    """Each row parsed; nothing where there is no file. Raises InputError naming file, line and what is wrong."""
    if not path.exists():
        return
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.reader(file)
        found = next(_rows(path, reader), [])
        if tuple(found) != tuple(header):
            raise InputError(f"{path}: columns {','.join(found)!r}; expected {','.join(header)!r}")
        for row in _rows(path, reader):
            try:
                if len(row) != len(header):
                    raise ValueError(f"{len(row)} cells, expected {len(header)}")
                yield parse(row)
            except ValueError as error:
                raise InputError(f"{path}, line {reader.line_num}: {error}; run the command again") from None


def _rows(path: Path, reader: Iterator[list[str]]) -> Iterator[list[str]]:
    """The rows of a file. Raises InputError where it is no text."""
    try:
        yield from reader
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: is no table of text: {error}; run the command again") from None


def read_columns(path: Path, axis: str) -> dict[str, Array]:
    """A table of numbers by column, the first being ``axis``; empty where there is no file or no row."""
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        header = next(_rows(path, csv.reader(file)), [])
    if header[:1] != [axis]:
        raise InputError(f"{path}: first column {header[:1]}; expected {axis!r}")
    rows = list(_read(path, header, lambda row: [_number(cell) for cell in row]))
    return dict(zip(header, np.array(rows, dtype=np.float64).T, strict=True)) if rows else {}
