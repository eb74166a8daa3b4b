"""What the live view costs the identifier: latency, lost messages and processor time with it and without.

    python -m bench.speed.live_view [--seconds 15] [--pairs 3] [--page docs/results/cost.md]

The flight and the identifier are those of `bench.speed.live`, all messages stamped together. Runs without and with
`sysid view --live --save FILE` alternate, so that what else the machine does is the same for both. Percentiles are over
the estimates of all runs of a kind, processor times of the whole processes from the first estimate on.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import rclpy

from bench.pages import publish, table
from bench.speed.live import IMU_RATE, SLOW_EVERY, fly, listen, processor_seconds, started
from sysid_node.ros.support.spin import run_program

TOPICS = ("imu/data", "air_data", "actuators")
_BEGINS = 4.0  # s, until the view has imported what it needs


@contextlib.contextmanager
def viewing(folder: Path, number: int) -> Iterator[subprocess.Popen[bytes]]:
    """The live view, writing into a file, in a process of its own."""
    command = [sys.executable, "-m", "sysid_node.cli", "view", "--live", "--aircraft", "cdrw", "--quiet"]
    process = subprocess.Popen([*command, "--save", str(folder / f"{number}.rrd")])
    end = time.monotonic() + 60.0
    while not (folder / f"{number}.rrd").exists() and time.monotonic() < end:
        time.sleep(0.1)
    time.sleep(_BEGINS)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def one(seconds: float, folder: Path, number: int, *, view: bool) -> dict[str, object]:
    """One run: latencies until publication (N,), s; lost messages; shares of a processor of identifier and view."""
    node = rclpy.create_node("bench")
    flight = get_context("spawn").Process(target=fly, args=(seconds, True), daemon=True)
    with contextlib.ExitStack() as stack:
        shown = stack.enter_context(viewing(folder, number)) if view else None
        process = stack.enter_context(started(bare=False))
        used, began = (processor_seconds(shown.pid) if shown else 0.0), time.monotonic()
        flight.start()
        latencies, words, share = listen(node, flight, process.pid)
        seen = (processor_seconds(shown.pid) - used) / (time.monotonic() - began) if shown else 0.0
    node.destroy_node()
    ticks = int(seconds * IMU_RATE) + 1
    sent = ticks + 2 * (1 + (ticks - 1) // SLOW_EVERY)
    lost = sent - sum(int(words[f"{topic}: received"]) for topic in TOPICS)
    return {"latency": 1e-9 * np.array([out for out, _ in latencies]), "lost": lost, "share": share, "view": seen}


def measured(seconds: float, pairs: int) -> str:
    """The table, from so many runs of each kind."""
    runs: dict[bool, list[dict[str, object]]] = {False: [], True: []}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(2 * pairs):
            view = number % 2 == 1
            runs[view].append(one(seconds, Path(folder), number, view=view))
    rows = []
    for view, found in runs.items():
        p50, p95, p99 = 1e3 * np.percentile(np.concatenate([run["latency"] for run in found]), (50, 95, 99))  # type: ignore[misc]
        shares = [100.0 * np.mean([run[key] for run in found]) for key in ("share", "view")]  # type: ignore[misc]
        lost = sum(int(run["lost"]) for run in found)  # type: ignore[call-overload]
        name = "with the live view" if view else "identifier alone"
        rows.append([name, *(f"{p:.2f}" for p in (p50, p95, p99)), str(lost), *(f"{s:.1f}" for s in shares)])
    heads = [
        f"{pairs} runs of {seconds:g} s each",
        "p50, ms",
        "p95, ms",
        "p99, ms",
        "lost",
        "identifier, CPU %",
        "view, CPU %",
    ]
    return table(heads, rows)


def main() -> None:
    """Print the table, or put it into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--page", type=Path)
    args = parser.parse_args()
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    sys.exit(run_program(lambda: publish("bench/speed/live_view.py", measured(args.seconds, args.pairs), args.page)))


if __name__ == "__main__":
    main()
