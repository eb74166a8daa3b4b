"""``sysid gap`` on real flights.

    python -m bench.gap.real_flights [--page docs/results/gap_real_flights.md]

HFB-320 in turbulence, the small UAV Thor whose surfaces are commands, and the Twin Otter: fitted on one part of the
record, measured on the other. Needs the folder of flight records, which is not part of the project.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.estimation.real import aircraft as known
from bench.pages import publish, table
from bench.withheld.mattering import coefficients
from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.model import Aircraft, Derivative
from sysid_node.flight.csv import read_csv, write_csv
from sysid_node.flight.record import FlightRecord

Part = tuple[float, float]

#: Tolerance of a belief: a share of its size, and at least so much.
_SHARE = 0.2
_LEAST = {"CL": 0.05, "CD": 0.01, "CY": 0.02, "Cl": 0.01, "Cm": 0.03, "Cn": 0.01}

_LATERAL = ("ay", "p", "r", "beta", "da", "dr")


@dataclass(frozen=True)
class Flight:
    """A record: its aircraft, the parts that are fitted and held out (s), and whether it is longitudinal only."""

    file: str
    aircraft: Callable[[Path], Aircraft]
    fitted: Part
    held: Part
    longitudinal: bool
    noise: Mapping[str, float]  # 1 sigma as the record shows it between samples


_THOR_NOISE = {"accel": 0.15, "gyro": 0.01, "airspeed": 0.2, "alpha": 0.006, "beta": 0.006, "attitude": 0.005}
_THOR_HALVES = ((0.0, 82.5), (82.6, 165.4))

FLIGHTS = {
    "hfb320": Flight(
        "hfb320.csv", known.hfb320, (0.0, 30.0), (30.0, 60.0), True,
        {"accel": 0.03, "gyro": 0.001, "airspeed": 0.1, "alpha": 0.001, "beta": 0.001, "attitude": 0.001},
    ),
    "thor": Flight("thor_75a.csv", known.thor, *_THOR_HALVES, False, _THOR_NOISE),
    "thor_other_half": Flight("thor_75a.csv", known.thor, *_THOR_HALVES[::-1], False, _THOR_NOISE),
    "twin_otter": Flight(
        "twin_otter_018.csv", known.twin_otter, (0.0, 8.0), (0.0, 0.0), True,
        {"accel": 0.03, "gyro": 0.0005, "airspeed": 0.1, "alpha": 0.0005, "beta": 0.0005, "attitude": 0.001},
    ),
}  # fmt: skip


def believed(aircraft: Aircraft, flight: Flight, record: FlightRecord) -> Aircraft:
    """The belief with tolerances, and moments of inertia where the published ones are not complete.

    Offsets are nowhere published: they balance the mean of the part that is fitted.
    """
    aircraft = balanced(aircraft, record)
    derivatives = {
        n: Derivative(d.value, max(_SHARE * abs(d.value), _LEAST[n[:2]])) for n, d in aircraft.derivatives.items()
    }
    inertia = aircraft.inertia
    if not math.isfinite(inertia.Ixx):  # of no account in a longitudinal motion, but the file must hold them
        inertia = replace(inertia, Ixx=inertia.Iyy, Izz=2.0 * inertia.Iyy)
    return replace(aircraft, derivatives=derivatives, inertia=inertia, noise=dict(flight.noise))


def balanced(aircraft: Aircraft, record: FlightRecord) -> Aircraft:
    """With the offsets (``CL_0`` and the like) that leave no mean in a record."""
    names = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi", "V", "alpha", "beta")
    seen = np.nan_to_num(np.column_stack([record[name] for name in names]))
    controls = [np.nan_to_num(record[symbol]) for symbol in aircraft.control_symbols]
    thrust = np.nan_to_num(record["thrust"])
    rate = 1.0 / float(np.median(np.diff(record.time)))
    inertia = aircraft.inertia
    known = replace(inertia, Ixx=np.nan_to_num(inertia.Ixx), Izz=np.nan_to_num(inertia.Izz))
    whole = replace(aircraft, inertia=known)
    found, x = coefficients(whole, seen, np.column_stack([*controls, thrust]), record["rho"], rate)
    x["V"] = record["V"] / aircraft.reference.airspeed
    derivatives = dict(aircraft.derivatives)
    for i, coefficient in enumerate(("CL", "CD", "CY", "Cl", "Cm", "Cn")):
        name = f"{coefficient}_0"
        own = [(n.partition("_")[2], d.value) for n, d in derivatives.items() if n.startswith(f"{coefficient}_")]
        told = coefficient != "CD" or not aircraft.throttle or record.measured("thrust")
        if name in derivatives and told:
            rest = found[:, i] - sum(value * x[regressor] for regressor, value in own if regressor != "0")
            derivatives[name] = replace(derivatives[name], value=float(np.mean(rest)))
    return replace(aircraft, derivatives=derivatives)


def part(record: FlightRecord, flight: Flight, span: Part) -> FlightRecord:
    """Of the record, by its time (s); lateral signals left out of a longitudinal flight."""
    keep = (record.time >= span[0]) & (record.time <= span[1])
    columns = {name: values[keep] for name, values in record.columns.items()}
    if flight.longitudinal:
        columns |= {name: np.full(int(keep.sum()), np.nan) for name in _LATERAL}
    return FlightRecord(record.time[keep] - record.time[keep][0], columns, record.name)


def diagnose(folder: Path, flight: Flight) -> tuple[str, dict[str, Any] | None]:
    """What ``sysid gap`` says in words, and its gap.json; only the words where it refuses."""
    record = read_csv(folder / flight.file)
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        fitted = part(record, flight, flight.fitted)
        belief = believed(flight.aircraft(folder), flight, fitted)
        (place / "aircraft.yaml").write_text(dump_aircraft(belief), encoding="utf-8")
        write_csv(place / "fitted.csv", fitted)
        words = ["gap", "fitted.csv", "--aircraft", "aircraft.yaml", "--out", "out"]
        if flight.held[1] > flight.held[0]:
            write_csv(place / "held.csv", part(record, flight, flight.held))
            words += ["--holdout", "held.csv"]
        done = subprocess.run(
            [sys.executable, "-m", "sysid_node.cli", *words], check=False, cwd=place, capture_output=True, text=True
        )
        result = place / "out" / "gap.json"
        if not result.exists():
            return done.stderr.strip().splitlines()[-1], None
        return _words(done.stdout), json.loads(result.read_text(encoding="utf-8"))


def _words(printed: str) -> str:
    """The opening paragraph, without the path of the report and without what a progress bar left."""
    lines = [line.strip() for line in printed.splitlines()]
    return " ".join(line for line in lines if line and "report.html" not in line and "%" not in line[:12])


def section(folder: Path, flight: Flight) -> str:
    """Of the page."""
    words, found = diagnose(folder, flight)
    parts = [f"> {words}"]
    if found is None:
        return parts[0]
    gap = found["gap"]
    row = [found["verdict"], *(f"{gap[k]:.3f}" for k in ("before", "tolerances", "after", "noise_floor"))]
    low, high = gap["ci95"]
    row.append(f"{gap['shrink_percent']:.0f} % ({low:.0f} to {high:.0f})")
    parts.append(table(("verdict", "before", "within tolerances", "after", "noise floor", "closed"), [row]))
    if found.get("air_motion"):
        parts.append(f"Air in motion across the path, rms: {found['air_motion']:.2f} m/s.")
    if found["causes"]:
        heads = ("cause", "probability", "parameters (s.e.)", "not told apart from")
        parts.append(table(heads, [_cause(cause) for cause in found["causes"]]))
    if found["doubted"]:
        heads = ("predicts better, but is doubted", "probability", "parameters (s.e.)", "not told apart from")
        parts.append(table(heads, [_cause(cause) for cause in found["doubted"]]))
    if found["next_flight"]:
        parts.append(f"To fly next: {found['next_flight']}")
    best = found.get("candidates", [])[:6]
    if best:
        said = ", ".join(f"{c['effect']} {c['share']:.2f}" for c in best)
        parts.append(f"What predicts best by itself, whether it is there or not, as shares of all tried: {said}.")
    return "\n\n".join(parts)


def _cause(cause: Mapping[str, Any]) -> list[str]:
    sizes = ", ".join(f"{name} {value:.3g} ({error:.2g})" for name, (value, error) in cause["parameters"].items())
    rivals = ", ".join(cause["indistinguishable_from"])
    return [str(cause.get("label", cause["effect"])), f"{cause['probability']:.2f}", sizes, rivals]


def main() -> None:
    """Print the sections, or put them in the documentation."""
    beside = Path(__file__).resolve().parents[3] / "shared" / "flights"
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=Path, default=Path(os.environ.get("SYSID_FLIGHTS", beside)))
    parser.add_argument("--only", choices=FLIGHTS, help="one aircraft")
    parser.add_argument("--page", type=Path, help="Markdown file whose sections to fill")
    args = parser.parse_args()
    if not args.flights.is_dir():
        print(f"flight records not found at {args.flights}: nothing to diagnose; give their folder as --flights")
        return
    for name, flight in FLIGHTS.items():
        if args.only in (None, name):
            publish(f"bench/gap/real_flights.py {name}", section(args.flights, flight), args.page)


if __name__ == "__main__":
    main()
