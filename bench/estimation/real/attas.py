"""VFW-614 ATTAS, lateral motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.estimation.real import aircraft, references
from bench.estimation.real.dimensional import Frequencies, Value, regress
from bench.estimation.real.replaying import Found, replays
from bench.estimation.real.showing import off, show
from bench.pages import table
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.csv import read_csv
from sysid_node.flight.record import FlightRecord

GRID: Frequencies = (0.1, 0.04, 1.5)  # Hz
BOOM = 13.08  # m from the CG to the nose boom, on whose vane the references' sideslip is measured
SECOND_RUN = 30.03  # s: the record is two runs joined


def flown(folder: Path) -> FlightRecord:
    """The record: sideslip at the CG."""
    return read_csv(folder / "attas_lateral_1.csv")


def at_boom(flight: FlightRecord) -> FlightRecord:
    """With the sideslip as the vane on the nose boom sees it."""
    V, alpha, beta = flight["V"], flight["alpha"], flight["beta"]
    u, w = V * np.cos(beta) * np.cos(alpha), V * np.cos(beta) * np.sin(alpha) - BOOM * flight["q"]
    v = V * np.sin(beta) + BOOM * flight["r"]
    return replace(flight, columns={**flight.columns, "beta": np.arctan2(v, np.hypot(u, w))})


def rates(flight: FlightRecord) -> dict[str, Value]:
    """Rates of roll and yaw rate on sideslip, both rates, aileron and rudder."""
    motion = {name: flight[name] for name in ("beta", "p", "r", "da", "dr")}
    sides = {"L": flight["p"], "N": flight["r"]}
    return regress(flight.time, sides, motion, GRID, rates=True, breaks=[SECOND_RUN])


def dimensional(found: Mapping[str, Found], flight: FlightRecord, known: Aircraft) -> dict[str, Value]:
    """Derivatives of Cl and Cn as angular accelerations for each rad and rad/s; Ixz couples both."""
    i, b = known.inertia, known.geometry.b
    moment = float(np.mean(0.5 * flight["rho"] * flight["V"] ** 2)) * known.geometry.S * b
    rate = b / (2.0 * float(np.mean(flight["V"])))
    values = {}
    for regressor, gain in {"beta": 1.0, "p": rate, "r": rate, "da": 1.0, "dr": 1.0}.items():
        Cl, Cn = found[f"Cl_{regressor}"], found[f"Cn_{regressor}"]
        for axis, roll, yaw in (("L", i.Izz, i.Ixz), ("N", i.Ixz, i.Ixx)):
            scale = gain * moment / (i.Ixx * i.Izz - i.Ixz**2)
            error = float(np.hypot(roll * Cl.error, yaw * Cn.error))
            values[f"{axis}_{regressor}"] = Value(scale * (roll * Cl.value + yaw * Cn.value), scale * error)
    return values


def section(folder: Path) -> str:
    """Of the page."""
    flight, known = flown(folder), aircraft.attas(folder)
    boom = at_boom(flight)
    replayed = {m: dimensional(r.derivatives, boom, known) for m, r in replays(boom, known, GRID).items()}
    columns = {
        "here": rates(boom),
        **{f"replay, {method}": values for method, values in replayed.items()},
        "sideslip at the CG": rates(flight),
    }
    rows = [
        [
            name,
            show(ref),
            *(text for values in columns.values() for text in (show(values[name]), off(values[name], ref))),
        ]
        for name, ref in references.ATTAS.items()
    ]
    return table(("", "ftr", *(head for column in columns for head in (column, "off, in its s.e."))), rows)
