"""Thor, an Ultra Stick 25e of 2 kg on autopilot: commands, not positions, and nothing flown for identification."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

from bench.estimation.real import aircraft
from bench.estimation.real.hfb320 import moved
from bench.estimation.real.ordinary import estimated, ordinary
from bench.estimation.real.replaying import Found, replay, replays
from bench.estimation.real.showing import show
from bench.pages import table
from sysid_node.flight.csv import read_csv
from sysid_node.flight.record import FlightRecord
from sysid_node.online.types import DerivativeEstimate
from sysid_node.report.wording.sources import source_words

PAIRS = (("da", "p"), ("de", "q"), ("dr", "r"))  # a command, and the rate that it turns
LAG = 0.05  # s by which the commands are ahead of the surfaces, as the correlations have it
BAND = (0.5, 5.0)  # Hz, in which command and response are compared
SERVO = 0.04  # s: how late the responses are known to be
REACH = 0.3  # s of delay that are tried, both ways


def flown(folder: Path) -> FlightRecord:
    """The record."""
    return read_csv(folder / "thor_75a.csv")


def correlation(flight: FlightRecord, command: str, rate: str) -> tuple[float, float]:
    """The strongest correlation of a command with an angular acceleration, and by how much (s) that comes later."""
    step = float(np.median(np.diff(flight.time)))
    band = butter(2, BAND, "band", fs=1.0 / step)
    u, y = (filtfilt(*band, signal) for signal in (flight[command], np.gradient(flight[rate], flight.time)))
    u, y = u / np.linalg.norm(u), y / np.linalg.norm(y)
    reach = round(REACH / step)
    found = {lag: float(np.roll(u, lag)[reach:-reach] @ y[reach:-reach]) for lag in range(-reach, reach + 1)}
    best = max(found, key=lambda lag: abs(found[lag]))
    return found[best], best * step


def section(folder: Path) -> str:
    """Of the page."""
    flight, known = flown(folder), aircraft.thor(folder)
    pairs = [(f"{u}, d{rate}/dt", *correlation(flight, u, rate)) for u, rate in PAIRS]
    heads = ("command, response", "strongest correlation", "response later by, s")
    delays = table(heads, ([name, f"{size:+.2f}", f"{lag:+.2f}"] for name, size, lag in pairs))
    late = flight
    for command, _ in PAIRS:
        late = moved(late, command, -LAG)
    columns = {**replays(flight, known), f"sls_rft, commands {LAG:g} s later": replay(late, known)}
    rows = [
        [name, *(text for r in columns.values() for text in (show(r.derivatives[name]), r.derivatives[name].status))]
        for name in known.derivatives
    ]
    rows += [
        [f"R^2 of {c}", *(text for r in columns.values() for text in (f"{r.r_squared[c]:.2f}", ""))]
        for c in known.model_structure
    ]
    return f"{delays}\n\n{table(('', *(head for column in columns for head in (column, 'status'))), rows)}"


def ordinary_section(folder: Path) -> str:
    """Of the page: from commands, by an aircraft file with tolerances that says nothing of the servos."""
    flight, known = flown(folder), aircraft.thor(folder)
    silent = estimated(flight, ordinary(known), "commands")
    stated = estimated(flight, ordinary(known, dict.fromkeys(known.controls, SERVO)), "commands")
    rows = []
    for name, published in known.derivatives.items():
        cells = [text for k in (silent, stated) for text in _cells(k.estimates.derivatives[name])]
        shares = silent.estimates.budget.get(name, {})
        largest = ", ".join(f"{source_words(key)[0]} {100 * x:.0f} %" for key, x in list(shares.items())[:1])
        rows.append(
            [name, f"{published.value:.4g}", *cells, largest if silent.estimates.derivatives[name].valid else ""]
        )
    heads = ("", "published", "file silent", "status", f"file: servos {1e3 * SERVO:.0f} ms", "status")
    times = [
        [name, *(f"{1e3 * s.value:.0f} ± {1e3 * s.standard_error:.0f}" for s in (silent.estimates.servos[name], late))]
        for name, late in stated.estimates.servos.items()
    ]
    servos = table(("servo, ms", "file silent", f"file: {1e3 * SERVO:.0f} ms"), times)
    return f"{servos}\n\n{table((*heads, 'largest in the budget, file silent'), rows)}"


def _cells(d: DerivativeEstimate) -> list[str]:
    return [show(Found(d.value, d.standard_error, d.status)), d.status]
