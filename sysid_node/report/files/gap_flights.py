"""``flights.csv`` of a gap's folder: the flights as measured, and as the simulator flies them.

One row a sample, at 50 Hz. Columns: ``flight`` (its place among those on which the gap is measured, from 0; parts of
an interrupted recording count one by one), ``time`` (s since the recording began), ``begins`` (1 where the simulator
starts again from the measured state), ``measured_``, ``file_`` (with the aircraft file) and ``corrected_`` (with the
causes) of each reading, the ``command_`` of each control (rad) and of thrust (N), ``rho``, and ``missing_file_`` and
``missing_corrected_`` of each coefficient: measured minus predicted. SI and radians. Readings of the simulator are
empty where no short flight could be flown, for example without roll and pitch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sysid_node.csv_table import write_table
from sysid_node.errors import InputError
from sysid_node.flight.record import Array
from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.residuals.residual_model import COEFFICIENTS, ResidualModel
from sysid_node.gap.short_flights.readings import can_be_simulated
from sysid_node.gap.validation.handed_on import corrected_parameters
from sysid_node.gap.validation.simulation_error import side_by_side
from sysid_node.report.files.runs.run_tables import read_columns
from sysid_node.sim.model.layout import OUTPUTS

FLIGHTS = "flights.csv"

#: Prefixes of the readings' columns, and of the coefficients that are missing.
STAGES = ("measured", "file", "corrected")
MISSING = ("missing_file", "missing_corrected")


@dataclass(frozen=True)
class FlightTable:
    """A flight of the table: ``time`` (N,) s and columns (N,) by name, NaN where empty."""

    time: Array
    columns: dict[str, Array]

    def __getitem__(self, name: str) -> Array:
        return self.columns.get(name, np.full(self.time.shape, np.nan))


def write_flights(path: Path, found: Diagnosis) -> None:
    """Write the table of all flights on which the gap is measured."""
    tables = [_columns(found, place) for place in range(len(found.models))]
    names = list(tables[0])
    rows = (
        (place, *row)
        for place, table in enumerate(tables)
        for row in zip(*(_shortened(table[name]) for name in names), strict=True)
    )
    write_table(path, ["flight", *names], rows, blank_nan=True)


def read_flights(path: Path) -> list[FlightTable]:
    """The flights of the table. Raises InputError where it is missing or damaged."""
    columns = read_columns(path, "flight")
    if not columns:
        raise InputError(f"{path}: no such table in this folder; run sysid gap again")
    places = columns.pop("flight")
    chosen = [places == place for place in np.unique(places)]
    return [
        FlightTable(columns["time"][rows], {name: values[rows] for name, values in columns.items()}) for rows in chosen
    ]


def _columns(found: Diagnosis, place: int) -> dict[str, Array]:
    """The columns of one flight."""
    model, evidence = found.models[place], found.check.corrected.flights[place]
    record = model.record
    readings = _readings(model, evidence.points)
    point = corrected_parameters(found.attribution.corrected, model)
    coefficients = len(COEFFICIENTS)
    left = [(model.series - model.predicted_series(p))[:, :coefficients] for p in (model.simulator.neutral(), point)]
    left = [np.where(model.axes[:coefficients], values, np.nan) for values in left]
    return {
        "time": model.time,
        **readings,
        **{f"command_{n}": v for n, v in zip(model.simulator.layout.commands, model.commands.T, strict=True)},
        "rho": record["rho"],
        **{f"{s}_{c}": v for s, values in zip(MISSING, left, strict=True)
           for c, v in zip(COEFFICIENTS, values.T, strict=True)},
    }  # fmt: skip


def _readings(model: ResidualModel, points: Sequence[Array]) -> dict[str, Array]:
    """``begins`` and the readings of each stage; those of the simulator are NaN where it cannot be started."""
    record = model.record
    if not can_be_simulated(model):
        nothing = np.full(len(record), np.nan)
        measured = {f"measured_{name}": record[name] for name in OUTPUTS}
        return {"begins": nothing, **measured, **{f"{s}_{n}": nothing for s in STAGES[1:] for n in OUTPUTS}}
    beside = side_by_side(model, points)
    series = (beside.measured, beside.before, beside.after)
    readings = {f"{s}_{n}": v for s, x in zip(STAGES, series, strict=True) for n, v in zip(OUTPUTS, x.T, strict=True)}
    return {"begins": beside.begins.astype(float), **readings}


def _shortened(values: Array) -> list[float]:
    """Numbers with seven digits, more than any sensor has."""
    return [float(f"{value:.7g}") for value in values.tolist()]
