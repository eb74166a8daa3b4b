"""How sharp the online estimator's intervals are, where everything is a little off at once.

    python -m bench.estimation.sharpness RESULTS.jsonl [--flights 12] [--first 7201] [--page FILE]

The flights are those of `bench.estimation.all_imperfections`. The total error of each derivative is divided by that of
the maximum-likelihood estimate from the whole flight with the same aircraft file: output error in still air, filter
error in turbulence. That is what the drawn imperfections make unavoidable, as far as the file's tolerances go. It is
also counted how many derivatives either makes narrow enough to be valid, whatever else may speak against them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.estimation.all_imperfections import AIRS, RATE, drawn, estimated, fly, known
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.online import estimator
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import DerivativeEstimate
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler

REFERENCES = {"none": "output_error", "light": "filter_error", "moderate": "filter_error"}

Line = dict[str, Any]


def measured(simulator: Simulator, aircraft: Aircraft, number: int) -> Line:
    """One line of the results: of each derivative what both say of it."""
    kind, effects = drawn(aircraft, number)
    sortie = fly(simulator, effects, kind["air"], number)
    streams, file = FlightSampler().record(sortie), known(aircraft, kind, effects, number)
    online = estimated("replay", file, streams, "auto")[0]
    reference = estimated(REFERENCES[kind["air"]], file, streams, "auto")[0]
    exact = FlightSampler(actuator_rate=200.0, surfaces="measured").record(fly(simulator, {}, kind["air"], number))
    ideal = replace(aircraft, ideal=True, noise_bias=dict.fromkeys(aircraft.noise_bias, 0.0))
    perfect, limits = estimated("replay", ideal, exact, "positions")[0], _limits(file)
    rows = {
        name: {
            "online": _told(online[name], limits[name], sortie.derivatives[name]),
            "reference": _told(reference[name], limits[name], sortie.derivatives[name]),
            "status": online[name].status,
            "valid_exact": perfect[name].valid,
        }
        for name in limits
        if name in reference
    }
    return {"number": number, **kind, "derivatives": rows}


def _limits(aircraft: Aircraft) -> dict[str, tuple[float, float]]:
    """The largest standard error of a valid estimate of each derivative, and the same as a share of its value."""
    index = estimator.init(aircraft, OnlineSettings()).model.table
    pairs = zip(index.allowed.tolist(), index.relative.tolist(), strict=True)
    return dict(zip(index.names, pairs, strict=True))


def _told(estimate: DerivativeEstimate, limits: tuple[float, float], truth: float) -> dict[str, Any]:
    largest = max(limits[0], limits[1] * abs(estimate.value))
    return {
        "error": float(estimate.standard_error),
        "narrow": bool(estimate.standard_error <= largest),
        "valid": bool(estimate.valid),
        "holds": bool(estimate.lower <= truth <= estimate.upper),
    }


def tables(lines: list[Line]) -> str:
    """By the air; then the statuses of what exact positions of a perfect aircraft make valid, and this does not."""
    heads = (
        "flights",
        "number",
        "total error over the reference's: median",
        "the same, of valid estimates",
        "valid, exact",
        "valid",
        "narrow enough",
        "narrow enough by the reference",
        "hold, all online",
        "hold, all of the reference",
    )
    body = [[name, str(len(some)), *_cells(some)] for name, some in _groups(lines)]
    return (
        f"{table(heads, body)}\n\n{table(('status at the end', 'wider than allowed', 'narrow enough'), _lost(lines))}"
    )


def _groups(lines: list[Line]) -> Iterator[tuple[str, list[Line]]]:
    yield "all", lines
    for air in AIRS:
        if some := [line for line in lines if line["air"] == air]:
            yield f"air: {'still' if air == 'none' else air}, {REFERENCES[air].replace('_', ' ')}", some


def _cells(lines: list[Line]) -> list[str]:
    rows = [row for line in lines for row in line["derivatives"].values()]
    ratios = np.array([row["online"]["error"] / row["reference"]["error"] for row in rows])
    valid = np.array([row["online"]["valid"] for row in rows])

    def each(flags: Iterator[bool]) -> str:
        return f"{sum(flags) / len(lines):.1f}"

    return [
        f"{np.median(ratios):.2f}",
        f"{np.median(ratios[valid]):.2f}" if valid.any() else "-",
        each(row["valid_exact"] for row in rows),
        each(row["online"]["valid"] for row in rows),
        each(row["online"]["narrow"] for row in rows),
        each(row["reference"]["narrow"] for row in rows),
        *(f"{100.0 * np.mean([row[who]['holds'] for row in rows]):.0f} %" for who in ("online", "reference")),
    ]


def _lost(lines: list[Line]) -> list[list[str]]:
    rows: list[Mapping[str, Any]] = [
        row
        for line in lines
        for row in line["derivatives"].values()
        if row["valid_exact"] and not row["online"]["valid"]
    ]
    kinds = {row["status"].partition(" with ")[0] for row in rows}
    found = []
    for kind in kinds:
        narrow = [row["online"]["narrow"] for row in rows if row["status"].partition(" with ")[0] == kind]
        found.append([kind, str(len(narrow) - sum(narrow)), str(sum(narrow))])
    return sorted(found, key=lambda cells: -int(cells[1]) - int(cells[2]))


def main() -> None:
    """Fly what is missing, and make the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, help="file of JSON lines: read, and continued")
    parser.add_argument("--flights", type=int, default=12, help="how many flights (default: 12)")
    parser.add_argument("--first", type=int, default=7201, help="number of the first flight (default: 7201)")
    parser.add_argument("--airs", nargs="+", choices=AIRS, default=AIRS, help="only flights in these (default: all)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    lines = [json.loads(text) for text in args.results.read_text().splitlines()] if args.results.exists() else []
    aircraft = load_aircraft("cdrw")
    simulator = Simulator(aircraft, RATE)
    for number in range(args.first, args.first + args.flights):
        if drawn(aircraft, number)[0]["air"] in args.airs and all(line["number"] != number for line in lines):
            lines.append(measured(simulator, aircraft, number))
            with args.results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(lines[-1]) + "\n")
    publish("bench/estimation/sharpness.py", tables(lines), args.page)


if __name__ == "__main__":
    main()
