"""What the engine of ``sysid fleet`` costs: processor time a flight, memory of the command, and what a worker adds.

``python -m bench.fleet.engine``: the flights' own work is a stub, in tables of 27 random derivatives, except for one
replay of a bundled flight beside which the engine's share is stated. Every measurement runs in a process of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.pages import publish, table
from sysid_node.api.fleet_flight import estimate_flight
from sysid_node.fleet.assembly import assembled
from sysid_node.fleet.catalogue.reading import read_catalogue
from sysid_node.fleet.engine.cluster import local_workers
from sysid_node.fleet.fleet import work_through
from sysid_node.fleet.outcome import FleetSettings, FlightOutcome, FlightTask
from sysid_node.fleet.plan import Plan
from sysid_node.fleet.results import FlightResult
from sysid_node.fleet.state.store import STATE, FleetState

ROOT = Path(__file__).resolve().parents[2]
DERIVATIVES = 27
BUSY = 0.5  # s of processor time of a busy stub


def stub(task: FlightTask) -> FlightOutcome:
    """Random estimates, at once."""
    rng = np.random.default_rng(int(task.flight.partition(".")[0]))
    root = rng.normal(size=(DERIVATIVES, DERIVATIVES))
    names = tuple(f"Cm_{i}" for i in range(DERIVATIVES))
    values, total = rng.normal(size=DERIVATIVES), root @ root.T
    return FlightOutcome(
        task.aircraft.name, "7", None, 60.0, names, values, total, 0.5 * total, np.ones(DERIVATIVES, bool)
    )


def busy(task: FlightTask) -> FlightOutcome:
    """Random estimates, after ``BUSY`` s of processor time."""
    end = time.process_time() + BUSY
    while time.process_time() < end:
        pass
    return stub(task)


def replayed(task: FlightTask) -> FlightOutcome:
    """The estimates of a bundled flight by its replay."""
    location = str(ROOT / "bags" / "cdrw_multistep")
    return estimate_flight(FlightTask(task.flight, location, task.aircraft, task.settings, task.cache))


WORKS = {"stub": stub, "busy": busy, "replay": replayed}


def measure(flights: int, workers: int, work: str) -> dict[str, float]:
    """One fleet in this process: times in s, memory in MB."""
    with TemporaryDirectory() as folder:
        place = Path(folder)
        for i in range(flights):
            (place / f"{i}.csv").write_text(f"time,p\n0.0,{i}\n")
        (place / "fleet.csv").write_text("path,aircraft,tail,date\n*.[c]sv,cdrw,7,2026-05-03\n")
        (place / "fleet.csv").rename(place / "catalogue.txt")
        catalogue = read_catalogue(place / "catalogue.txt")
        out = place / "out"
        out.mkdir()
        state = FleetState(out / STATE)
        plan = Plan(catalogue, FleetSettings(), state)
        with local_workers(workers, "2GB") as opened:
            warm(opened.client, workers)
            before, used = time.monotonic(), time.process_time()
            work_through(plan, state, out, opened, WORKS[work])
            wall, processor = time.monotonic() - before, time.process_time() - used
            engine = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            taken = [entry.took for entry in state.entries()]
        before = time.process_time()
        found = assembled(plan, state)
        assert len(found.flights) == flights
        assert isinstance(found.flights[0], FlightResult)
        assembly = time.process_time() - before
        size = (out / STATE).stat().st_size / 1e6
        state.close()
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        "wall": wall, "processor": processor, "engine_mb": engine, "results_mb": after, "taken": sum(taken),
        "assembly": assembly, "file_mb": size,
    }  # fmt: skip


def warm(client: object, workers: int) -> None:
    """Wait for all workers, and let each import what the work needs."""
    client.wait_for_workers(workers)  # type: ignore[attr-defined]
    client.run(_imported)  # type: ignore[attr-defined]


def _imported() -> bool:
    return "bench.fleet.engine" in sys.modules


def alone(*words: object) -> dict[str, float]:
    """``measure`` in a process of its own."""
    command = [sys.executable, "-m", "bench.fleet.engine", "--one", *map(str, words)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, env=dict(os.environ))
    return dict(json.loads(done.stdout))


def main() -> None:
    """Print the tables, or put them into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path)
    parser.add_argument("--flights", type=int, nargs="+", default=[100, 500, 2000])
    parser.add_argument("--one", nargs=3, metavar=("FLIGHTS", "WORKERS", "WORK"), help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.one:
        print(json.dumps(measure(int(args.one[0]), int(args.one[1]), args.one[2])))
        return
    publish("bench/fleet/engine.py", "\n\n".join([sizes(args.flights), share(), speed()]), args.page)


def sizes(counts: list[int]) -> str:
    """Stubbed flights: the command's processor time and memory by their number."""
    rows = []
    for count in counts:
        m = alone(count, 2, "stub")
        per = 1e3 * m["processor"] / count
        rows.append(
            [str(count), f"{per:.1f}", f"{m['engine_mb']:.0f}", f"{m['results_mb']:.0f}", f"{m['file_mb']:.1f}"]
        )
    heads = [
        "stubbed flights",
        "processor, ms a flight",
        "memory at work, MB",
        "with all results, MB",
        "state file, MB",
    ]
    return table(heads, rows)


def share() -> str:
    """The engine beside a replay of one minute of flight."""
    m = alone(8, 1, "replay")
    heads = ["8 replays of 60 s, 1 worker", "s a flight"]
    rows = [
        ["the flight's work, as its worker took it", f"{m['taken'] / 8:.2f}"],
        ["processor time of command and scheduler", f"{m['processor'] / 8:.3f}"],
        ["share of the flight's", f"{100 * m['processor'] / m['taken']:.1f} %"],
    ]
    return table(heads, rows)


def speed() -> str:
    """Busy stubs on one worker and on two."""
    rows = []
    for workers in (1, 2):
        m = alone(24, workers, "busy")
        rows.append([str(workers), f"{m['wall']:.1f}", f"{m['taken']:.1f}", f"{24 * BUSY / m['wall']:.2f}"])
    heads = [
        f"workers, 24 stubs of {BUSY:g} s processor time",
        "wall, s",
        "sum of the flights' wall, s",
        "processors used",
    ]
    return table(heads, rows)


if __name__ == "__main__":
    main()
