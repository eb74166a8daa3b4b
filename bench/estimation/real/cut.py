"""Measured positions cut from records: commands are made of them, and the servos and derivatives are found again.

A servo of first order with the time constant T that follows commands u, each held over a period h, passes the positions
x at the samples if u_k = (x_{k+1} - a x_k) / (1 - a) with a = exp(-h / T): its equation, solved exactly, backwards
(Franklin, Powell & Workman, "Digital Control of Dynamic Systems", 3rd ed., 1998, sec. 4.3). So the recorded motion is
what an aircraft with such servos would have recorded, noise and all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench.estimation.real import aircraft, attas, cessna, hfb320, twin_otter
from bench.estimation.real.dimensional import Frequencies
from bench.estimation.real.ordinary import Known, apart, estimated, ordinary
from bench.pages import table
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import FlightRecord

LAGS = (0.03, 0.06, 0.1)  # s
STATED_SHARE = 0.7  # of the lag, where the aircraft file is wrong


class Case(NamedTuple):
    """A record, and what its surfaces' columns are."""

    name: str
    flight: FlightRecord
    known: Aircraft
    frequencies: Frequencies | None
    carried: str


def commanded(flight: FlightRecord, symbols: Sequence[str], lag: float) -> FlightRecord:
    """The record with commands, held from sample to sample, that servos of this ``lag`` (s) turn into its positions."""
    decay = np.exp(-np.diff(flight.time) / lag)
    columns = dict(flight.columns)
    for symbol in symbols:
        x = flight[symbol]
        u = (x[1:] - decay * x[:-1]) / (1.0 - decay)
        columns[symbol] = np.append(u, u[-1])
    return replace(flight, columns=columns)


def cases(folder: Path) -> list[Case]:
    """The records whose surfaces were measured, and two simulated ones that hold commands already."""
    found = [
        Case("Twin Otter", twin_otter.flown(folder), aircraft.twin_otter(folder), twin_otter.GRID, "positions"),
        Case("HFB-320", hfb320.flown(folder), aircraft.hfb320(folder), hfb320.GRID, "positions"),
        Case("ATTAS", apart(attas.flown(folder), attas.SECOND_RUN), aircraft.attas(folder), attas.GRID, "positions"),
    ]
    return found + [
        Case(f"Cessna {m}", cessna.flown(folder, m), cessna.known(folder, m), None, "commands") for m in ("de", "dadr")
    ]


def section(folder: Path) -> str:
    """Of the page."""
    rows = [row for case in cases(folder) for row in _rows(case)]
    heads = ("record", "lag undone, ms", "the file says, ms", "valid", "valid from positions, too", "of these hold")
    return table((*heads, "servos found, ms", "in the record itself, ms"), rows)


def _rows(case: Case) -> list[list[str]]:
    silent = ordinary(case.known)
    positions = estimated(case.flight, silent, case.carried, case.frequencies)
    # where a record's positions are not said to be such, their own lateness is estimated
    own = estimated(case.flight, silent, "auto" if case.carried == "positions" else "commands", case.frequencies)
    symbols = {name: control.symbol for name, control in case.known.controls.items()}
    rows = []
    for lag in LAGS:
        flight = commanded(case.flight, list(symbols.values()), lag)
        # a record that holds commands has a servo of its own, which a file that states the added one alone contradicts
        shares = (0.0, 1.0, STATED_SHARE) if case.carried == "positions" else (0.0,)
        for share in shares:
            stated = dict.fromkeys(symbols, share * lag) if share else None
            found = estimated(flight, ordinary(case.known, stated), "commands", case.frequencies)
            words = f"{1e3 * share * lag:.0f}" if share else "nothing"
            rows.append([case.name, f"{1e3 * lag:.0f}", words, *_counts(found, positions), _times(found), _times(own)])
    return rows


def _counts(found: Known, positions: Known) -> list[str]:
    """How many are valid; of these from positions, too; and how many of these intervals hold what positions gave."""
    both = [name for name in found.valid if name in positions.valid]
    there, here = positions.estimates.derivatives, found.estimates.derivatives
    hold = sum(here[name].lower <= there[name].value <= here[name].upper for name in both)
    return [str(len(found.valid)), str(len(both)), str(hold)]


def _times(found: Known) -> str:
    """Servos' times."""
    return ", ".join(f"{1e3 * s.value:.0f} ± {1e3 * s.standard_error:.0f}" for s in found.estimates.servos.values())
