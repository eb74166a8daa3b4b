"""How often `sysid gap` sees a surface that is counted the other way: real, bundled and simulated flights.

    python -m bench.robustness.opposite_surfaces [--first 1] [--page docs/results/wrong_readings.md]

The flights are changed as a user may have them. Real ones are the parts of records of ``bench.gap.spikes``, with the
aircraft files that are believed there; ``SYSID_FLIGHTS`` names their folder.
"""

from __future__ import annotations

import argparse
import math
import os
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.gap.spikes import gap_flight
from bench.pages import publish, table
from bench.robustness.flights import grouped
from bench.spikes.records import FLIGHTS, belief, part
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.record import FlightRecord
from sysid_node.gap.flightdata.gap_flight import GapFlight, completed_flights, load_gap_flights
from sysid_node.gap.flightdata.opposite_readings import check_directions

_SURFACES = ("de", "da", "dr")
_NO_VANES = {"alpha": math.nan, "beta": math.nan}
_LATE = (0.1, 0.2, 0.4, -0.05, -0.1)  # s; negative: before they are recorded, with late stamps

#: The factors of the readings, by what is wrong.
_MISTAKES: Mapping[str, Mapping[str, float]] = {
    "nothing": {},
    "nothing, without vanes": _NO_VANES,
    "elevator reversed": {"de": -1.0},
    "aileron reversed": {"da": -1.0},
    "rudder reversed": {"dr": -1.0},
    "all surfaces reversed": dict.fromkeys(_SURFACES, -1.0),
    "all surfaces reversed, without vanes": {**dict.fromkeys(_SURFACES, -1.0), **_NO_VANES},
    "lateral accelerometer reversed": {"ay": -1.0},
}

_Known = tuple[Aircraft, GapFlight]


def main() -> None:
    """Print the table, or put it in a page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=1, help="seed of the simulated flights (default: 1)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    groups = grouped(_real(), _known, args.first)
    rows = [(wrong, *(_count(flights, factors) for flights in groups.values())) for wrong, factors in _MISTAKES.items()]
    rows.append(("positions from -1 to 1", *(_count(flights, None) for flights in groups.values())))
    rows += [
        (
            f"surfaces act {abs(late):g} s {'late' if late > 0.0 else 'early'}",
            *(_count(flights, {}, late) for flights in groups.values()),
        )
        for late in _LATE
    ]
    heads = ("what is wrong", *(f"{name} ({len(flights)})" for name, flights in groups.items()))
    publish("bench/robustness/opposite_surfaces.py", table(heads, rows), args.page)


def _real() -> Iterator[_Known]:
    folder = Path(os.environ.get("SYSID_FLIGHTS", ""))
    for name, flight in FLIGHTS.items() if folder.name else ():
        aircraft = belief(folder, flight)
        for span in dict.fromkeys((*flight.fitted, *flight.held)):
            yield aircraft, gap_flight(aircraft, part(folder, flight, span), name)


def _known(bag: Path, name: str) -> _Known:
    aircraft = load_aircraft(name)
    return aircraft, load_gap_flights(bag, aircraft, None, "flu")[0]


def _count(flights: list[_Known], factors: Mapping[str, float] | None, late: float = 0.0) -> str:
    """How many flights are refused or warned of, with their readings changed; no factors: positions from -1 to 1."""
    return str(sum(_refused(aircraft, flight, factors, late) for aircraft, flight in flights))


def _refused(aircraft: Aircraft, flight: GapFlight, factors: Mapping[str, float] | None, late: float) -> bool:
    limits = {each.symbol: each.limit for each in aircraft.controls.values() if each.limit}
    factors = {name: 1.0 / limit for name, limit in limits.items()} if factors is None else factors
    record = _early(flight.record, late)
    columns = dict(record.columns)
    columns |= {name: factor * columns[name] for name, factor in factors.items() if name in columns}
    changed = replace(flight, record=replace(record, columns=columns), inferred=(), history=None)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always", InputWarning)
        try:
            check_directions(aircraft, completed_flights(aircraft, changed)[0])
        except InputError as error:
            return "counted the other way" in str(error)
    said = [str(each.message) for each in warned]
    return any("from -1 to 1" in text or "sign of ay" in text for text in said)


def _early(record: FlightRecord, seconds: float) -> FlightRecord:
    """The record with surfaces that are recorded so long before they act."""
    columns = dict(record.columns)
    columns |= {name: np.interp(record.time + seconds, record.time, columns[name]) for name in _SURFACES}
    return replace(record, columns=columns)


if __name__ == "__main__":
    main()
