"""Coverage of the intervals of `sysid identify` with a user's flights, from commands alone.

    python -m bench.batch.commands RESULTS.jsonl [--seeds 6] [--only METHOD] [--page docs/results/batch_commands.md]

Flights of `sysid simulate --aircraft cdrw --manoeuvre 3211:repeat=3` from the commands of the autopilot, plain ones and
those of servos of 30 ms that the aircraft file does not know. Counted are, among 27 derivatives, those that are valid,
the 95 % intervals of these that hold the truth, and those more than four standard errors off; once with the file as it
is, whose tolerances are the defaults, and once by the statistical part of the standard errors alone.
"""

from __future__ import annotations

import argparse
import json
import time
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from bench.estimation.all_imperfections import fly
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.batch.identify import METHODS, identify
from sysid_node.batch.settings import BatchSettings
from sysid_node.flight.align import flight_record
from sysid_node.flight.record import FlightRecord
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler

FLIGHTS = {"plain": {}, "servos of 30 ms": {"actuator_lag": {"time_constant": 0.03}}}
RATE = 1000.0  # Hz
NORMAL_95 = 1.96


@cache
def simulated() -> Simulator:
    """The simulator of all flights."""
    return Simulator(load_aircraft("cdrw"), RATE)


@lru_cache(maxsize=2)
def flown(name: str, seed: int) -> tuple[FlightRecord, dict[str, float]]:
    """A flight as aligned columns, and the true derivatives."""
    simulator = simulated()
    sortie = fly(simulator, FLIGHTS[name], "none", seed)
    return flight_record(simulator.aircraft, FlightSampler().record(sortie), 0.2, "auto"), sortie.derivatives


def estimated(method: str, name: str, seed: int) -> dict[str, Any]:
    """One line of the results."""
    record, true = flown(name, seed)
    begin = time.process_time()
    fit = identify(method, simulated().aircraft, [record], BatchSettings(segment=10.0)).fit
    rows = {
        key: [
            e.value,
            e.standard_error,
            e.statistical_error,
            e.lower,
            e.upper,
            float(e.valid and fit.search.converged),
            truth,
        ]
        for key, truth in true.items()
        if (e := fit.estimates.get(key)) is not None
    }
    servos = {key: [e.value, e.standard_error] for key, e in fit.systematic.servos.items()}
    return {
        "method": method, "flight": name, "seed": seed, "seconds": time.process_time() - begin, "rows": rows,
        "servos": servos,
    }  # fmt: skip


def row(method: str, lines: list[dict[str, Any]]) -> list[str]:
    """One method: valid, hold, far off on each kind of flight, and what it takes."""
    cells = [method.replace("_", " ")]
    for name in FLIGHTS:
        some = [line for line in lines if line["method"] == method and line["flight"] == name]
        valid = [r for line in some for r in line["rows"].values() if r[5]]
        if not valid:
            cells += ["-"] * 5
            continue
        hold = sum(low <= truth <= high for _, _, _, low, high, _, truth in valid)
        alone = sum(abs(v - truth) <= NORMAL_95 * error for v, _, error, _, _, _, truth in valid)
        far = sum(abs(v - truth) > 4.0 * error for v, error, _, _, _, _, truth in valid)
        shares = [f"{100.0 * n / len(valid):.0f} %" for n in (hold, far, alone)]
        cells += [str(len(some)), f"{len(valid) / len(some):.1f}", *shares]
    seconds = [line["seconds"] for line in lines if line["method"] == method]
    return [*cells, f"{sum(seconds) / len(seconds):.0f}" if seconds else "-"]


def main() -> None:
    """Fly what is missing, and make the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path, help="file of JSON lines: read, and continued")
    parser.add_argument("--seeds", type=int, default=6, help="flights of each kind (default: 6)")
    parser.add_argument("--only", action="append", default=[], choices=METHODS, help="a method (repeatable)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    text = args.results.read_text(encoding="utf-8") if args.results.exists() else ""
    lines = [json.loads(line) for line in text.splitlines()]
    for seed in range(1, args.seeds + 1):
        for name in FLIGHTS:
            for method in args.only or METHODS:
                if any((line["method"], line["flight"], line["seed"]) == (method, name, seed) for line in lines):
                    continue
                lines.append(estimated(method, name, seed))
                with args.results.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(lines[-1]) + "\n")
    counts = ("flights", "valid", "hold", "> 4 s.e.", "hold by the statistical part alone")
    heads = ("method", *(f"{name}: {one}" for name in FLIGHTS for one in counts), "processor, s")
    publish("bench/batch/commands.py", table(heads, (row(method, lines) for method in METHODS)), args.page)


if __name__ == "__main__":
    main()
