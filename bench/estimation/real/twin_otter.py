"""DHC-6 Twin Otter: NASA's example of the recursive transform."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.estimation.real import aircraft, references
from bench.estimation.real.dimensional import Array, Frequencies, Value, regress
from bench.estimation.real.replaying import replays
from bench.estimation.real.showing import off, show
from bench.pages import table
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.csv import read_csv
from sysid_node.flight.record import FlightRecord

GRID: Frequencies = (0.1, 0.04, 1.5)  # Hz, of the reference
DENSE: Frequencies = (0.3, 0.01, 1.3)


def flown(folder: Path) -> FlightRecord:
    """The record."""
    return read_csv(folder / "twin_otter_018.csv")


def rates(flight: FlightRecord, grid: Frequencies) -> dict[str, Value]:
    """Rates of angle of attack and pitch rate on angle of attack, pitch rate and elevator."""
    motion = {name: flight[name] for name in ("alpha", "q", "de")}
    return regress(flight.time, {"Z": flight["alpha"], "M": flight["q"]}, motion, grid, rates=True)


def vertical_force(flight: FlightRecord, known: Aircraft) -> dict[str, Value]:
    """CZ on angle of attack, pitch rate and elevator."""
    V, g = flight["V"], known.geometry
    CZ = known.mass * flight["az"] / (0.5 * flight["rho"] * V**2 * g.S)
    motion = {"alpha": flight["alpha"], "q": flight["q"] * g.cbar / (2.0 * V), "de": flight["de"]}
    return regress(flight.time, {"CZ": CZ}, motion, GRID)


def textbook(flight: FlightRecord, grid: Frequencies) -> dict[str, Value]:
    """The same with plain sums, jw times the transform, and lines taken for independent: what ``rtpid`` does."""
    omega = 2.0 * np.pi * np.arange(grid[0], grid[2] + 1e-9, grid[1])
    motion = {"alpha": flight["alpha"] - flight["alpha"][0], "q": flight["q"], "de": flight["de"] - flight["de"][0]}
    X = np.exp(-1j * np.outer(omega, flight.time)) @ np.column_stack(list(motion.values()))
    inverse: Array = np.linalg.inv((X.conj().T @ X).real)
    found: dict[str, Value] = {}
    for equation, y in (("Z", 1j * omega * X[:, 0]), ("M", 1j * omega * X[:, 1])):
        theta = inverse @ (X.conj().T @ y).real
        variance = np.sum(np.abs(y - X @ theta) ** 2) / (omega.size - len(motion))
        values = map(Value, theta.tolist(), np.sqrt(variance * inverse.diagonal()).tolist())
        found |= {f"{equation}_{name}": value for name, value in zip(motion, values, strict=True)}
    return found


def section(folder: Path) -> str:
    """Of the page."""
    flight = flown(folder)
    return f"{_rates(flight)}\n\n{_coefficients(flight, aircraft.twin_otter(folder))}"


def _rates(flight: FlightRecord) -> str:
    ours, dense = rates(flight, GRID), rates(flight, DENSE)
    plain = textbook(flight, DENSE)
    rows = [
        [name, show(reference), show(ours[name]), off(ours[name], reference), show(dense[name]), show(plain[name])]
        for name, reference in references.TWIN_OTTER_RATES.items()
    ]
    heads = (
        "",
        "SIDPAC rtpid",
        "here",
        "off, in its s.e.",
        "dense grid: here",
        "dense grid: lines taken for independent",
    )
    return table(heads, rows)


def _coefficients(flight: FlightRecord, known: Aircraft) -> str:
    CZ, replayed = vertical_force(flight, known), replays(flight, known, GRID)
    rows = []
    for name, reference in references.TWIN_OTTER_COEFFICIENTS.items():
        found = [CZ[name]] if name in CZ else [r.derivatives[name] for r in replayed.values()]
        numbers = [text for value in found for text in (show(value), off(value, reference))]
        rows.append([name, show(reference), *numbers, *[""] * (4 - len(numbers))])
    return table(("", "SIDPAC", "here, sls_rft", "off, in its s.e.", "iv_rft", "off"), rows)
