"""Vanes cut from real records: derivatives by flow angles that the IMU and the airspeed tell, beside those by vanes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.estimation.real import attas
from bench.estimation.real.ordinary import Known, estimated, ordinary
from bench.pages import table
from bench.spikes.records import FLIGHTS, belief
from sysid_node.flight.record import FlightRecord


def section(folder: Path) -> str:
    """Of the page: the lateral record of the ATTAS. The file's derivatives are those of the record itself."""
    file, flight = ordinary(belief(folder, FLIGHTS["attas"])), attas.flown(folder)
    seeing, blind = (estimated(each, file, "positions", attas.GRID) for each in (flight, without_angles(flight)))
    return table(("", "with vanes", "without"), _rows(seeing, blind))


def without_angles(flight: FlightRecord) -> FlightRecord:
    """The record without measured flow angles."""
    nothing = np.full(flight.time.size, np.nan)
    return replace(flight, columns={**flight.columns, "alpha": nothing, "beta": nothing})


def _rows(seeing: Known, blind: Known) -> list[list[str]]:
    rows = []
    for name in dict.fromkeys((*seeing.valid, *blind.valid)):
        cells = []
        for known in (seeing, blind):
            found = known.estimates.derivatives[name]
            words = "" if found.valid else f" ({found.status})"
            cells.append(f"{found.value:.3f} ± {found.standard_error:.3f}{words}")
        rows.append([name, *cells])
    return rows
