"""How often a reading of the wrong sign or unit is seen: real, bundled and simulated flights, each mistake in turn.

    python -m bench.robustness.wrong_readings [--first 1] [--page docs/results/wrong_readings.md]

A flight is changed as a user may have it, and read as ``sysid replay`` and ``sysid identify`` read it. Flights shorter
than 15 s, which tell nothing, are left out. ``SYSID_FLIGHTS`` names the folder of the real flights, whose lift is not
compared with an aircraft file.
"""

from __future__ import annotations

import argparse
import math
import os
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench.pages import publish, table
from bench.robustness.flights import grouped
from sysid_node import load
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.csv import read_csv
from sysid_node.flight.live.mean_lift import mean_lift
from sysid_node.flight.live.reading_signs import checked_signs
from sysid_node.flight.record import FlightRecord

_SHORTEST = 15.0  # s
_UNMEASURED = {"phi": math.nan, "theta": math.nan, "psi": math.nan}
_LATE = (-0.5, -0.3, -0.1, 0.1, 0.3, 0.5)  # s
_DEGREES = math.degrees(1.0)

#: By what is wrong: the factors of the readings, and a part of what is then said.
_MISTAKES: Mapping[str, tuple[Mapping[str, float], str]] = {
    "nothing": ({}, ""),
    "p reversed": ({"p": -1.0}, "p"),
    "q reversed": ({"q": -1.0}, "q"),
    "r reversed": ({"r": -1.0}, "r"),
    "q and r reversed: forward, left, up as forward, right, down": ({"q": -1.0, "r": -1.0}, "q"),
    "the same without attitude": ({"q": -1.0, "r": -1.0, **_UNMEASURED}, "q"),
    "angle of attack reversed": ({"alpha": -1.0}, "angle of attack"),
    "sideslip reversed": ({"beta": -1.0}, "sideslip"),
    "rates in deg/s": (dict.fromkeys("pqr", _DEGREES), "times what the attitude turns"),
    "airspeed in knots": ({"V": 1.944}, "true_airspeed"),
    "airspeed in mph": ({"V": 2.237}, "true_airspeed"),
    "airspeed in km/h": ({"V": 3.6}, "true_airspeed"),
    "attitude that stands still": (dict.fromkeys(_UNMEASURED, 0.0), ""),
    "attitude reversed": (dict.fromkeys(_UNMEASURED, -1.0), ""),
}


def main() -> None:
    """Print the table, or put it in a page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=1, help="seed of the simulated flights (default: 1)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    groups = grouped(_real(), _read, args.first)
    rows = [(mistake, *(_share(flights, *_MISTAKES[mistake]) for flights in groups.values())) for mistake in _MISTAKES]
    rows += [
        (
            f"air data {late:g} s late",
            *(_share([_late(flight, late) for flight in flights], {}, "late") for flights in groups.values()),
        )
        for late in _LATE
    ]
    heads = ("what is wrong", *(f"{name} ({len(flights)})" for name, flights in groups.items()))
    publish("bench/robustness/wrong_readings.py", table(heads, rows), args.page)


class _Flight(NamedTuple):
    record: FlightRecord
    aircraft: Aircraft | None


def _read(bag: Path, name: str) -> _Flight:
    flight = load(bag, name)
    return _Flight(flight.record, flight.aircraft)


def _real() -> Iterator[_Flight]:
    folder = Path(os.environ.get("SYSID_FLIGHTS", ""))
    for path in sorted(folder.glob("*.csv")) if folder.name else []:
        flight = read_csv(path)
        if flight.time[-1] - flight.time[0] >= _SHORTEST:
            yield _Flight(flight, None)


def _late(flight: _Flight, seconds: float) -> _Flight:
    """The flight with air data that come so late: an error of the stamps, which is not refused."""
    record = flight.record
    columns = dict(record.columns)
    columns |= {
        name: np.interp(record.time - seconds, record.time, columns[name])
        for name in ("V", "alpha", "beta")
        if name in columns
    }
    return flight._replace(record=replace(record, columns=columns))


def _share(flights: list[_Flight], factors: Mapping[str, float], said: str) -> str:
    """How many flights are refused for what is wrong, and how many for something else."""
    texts = [_fault(flight, factors) for flight in flights]
    right = sum(bool(text) and said in text for text in texts)
    other = sum(bool(text) for text in texts) - right
    return f"{right} and {other} otherwise" if other else str(right)


def _fault(flight: _Flight, factors: Mapping[str, float]) -> str:
    """Why the flight is refused with its readings changed; empty where it is not."""
    columns = dict(flight.record.columns)
    columns |= {name: factor * columns[name] for name, factor in factors.items() if name in columns}
    record = replace(flight.record, columns=columns, name="flight")
    opposite_alpha = flight.aircraft is not None and mean_lift(flight.aircraft, record).opposite_alpha
    try:
        checked_signs(record, opposite_alpha=opposite_alpha)
    except InputError as error:
        return str(error).removeprefix("flight: ")
    return ""


if __name__ == "__main__":
    main()
