"""HFB-320, longitudinal motion in turbulence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.estimation.real import aircraft, references
from bench.estimation.real.dimensional import Frequencies, Value, regress
from bench.estimation.real.replaying import replay, replays
from bench.estimation.real.showing import show
from bench.pages import table
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.csv import read_csv
from sysid_node.flight.record import FlightRecord

GRID: Frequencies = (0.1, 0.04, 1.5)  # Hz
ADVANCES = (0.05, 0.1)  # s by which the angle of attack is taken earlier, to see what hangs on it


def flown(folder: Path) -> FlightRecord:
    """The record."""
    return read_csv(folder / "hfb320.csv")


def moved(flight: FlightRecord, column: str, seconds: float) -> FlightRecord:
    """With one column taken ``seconds`` earlier (later where negative) than it stands in the record."""
    values = np.interp(flight.time + seconds, flight.time, flight[column])
    return replace(flight, columns={**flight.columns, column: values})


def lags(flight: FlightRecord, known: Aircraft) -> tuple[Value, Value]:
    """By how much (s) the angle of attack lags behind what it makes: the vertical force, and the pitching moment."""
    V, g = flight["V"], known.geometry
    pressure = 0.5 * flight["rho"] * V**2 * g.S
    angle = {"alpha": flight["alpha"], "rate": np.gradient(flight["alpha"], flight.time), "de": flight["de"]}
    force = regress(flight.time, {"CZ": known.mass * flight["az"] / pressure}, angle, GRID)
    engines = known.throttle.arm * flight["thrust"] if known.throttle else 0.0
    moment = (known.inertia.Iyy * np.gradient(flight["q"], flight.time) - engines) / (pressure * g.cbar)
    motion = {**angle, "q": flight["q"] * g.cbar / (2.0 * V), "V": V / known.reference.airspeed}
    turning = regress(flight.time, {"Cm": moment}, motion, GRID)
    return _ratio(force["CZ_rate"], force["CZ_alpha"]), _ratio(turning["Cm_rate"], turning["Cm_alpha"])


def _ratio(part: Value, whole: Value) -> Value:
    return Value(part.value / whole.value, part.error / abs(whole.value))


def section(folder: Path) -> str:
    """Of the page."""
    flight, known = flown(folder), aircraft.hfb320(folder)
    columns = {f"here, {method}": found for method, found in replays(flight, known, GRID).items()}
    for seconds in ADVANCES:
        early = replay(moved(flight, "alpha", seconds), known, frequencies=GRID)
        columns[f"sls_rft, alpha {seconds:g} s earlier"] = early
    programs = {
        "filter error": references.HFB_FILTER_ERROR,
        "EKF": references.HFB_EKF,
        "output error": references.HFB_OUTPUT_ERROR,
    }
    rows = [
        [name, *(show(r.derivatives[name]) for r in columns.values()), *(show(p[name]) for p in programs.values())]
        for name in references.HFB_FILTER_ERROR
    ]
    lift, moment = lags(flight, known)
    said = f"The angle of attack lags behind the vertical force by {show(lift)} s, behind the pitching moment by "
    return f"{table(('', *columns, *programs), rows)}\n\n{said}{show(moment)} s."
