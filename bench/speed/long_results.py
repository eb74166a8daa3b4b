"""Memory of what `sysid replay` keeps of a long flight and writes at its end, without the estimator's hours of work.

    python -m bench.speed.long_results [--hours 1 3 6] [--page docs/results/cost.md]

The messages of a bundled flight of a minute, stamped a minute later each time, are aligned and kept as a replay does
it, a piece a minute. The estimates, 20 a second, are those of one replay of that minute. Then all results are written:
report, tables, estimates. Each length has a process of its own. ``long_replay`` is the whole command.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import tempfile
import time
from array import array
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench.pages import publish, table
from bench.speed.long_replay import FLIGHT, MINUTE
from sysid_node.aircraft.load import load_aircraft
from sysid_node.api import load, replay
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.streams import Streams
from sysid_node.online.alignment.in_pieces import PieceAlignment
from sysid_node.online.estimates.log import EstimatesLog
from sysid_node.report.results.recorded_samples import RecordedSamples

RATE, SAMPLES = 20, 12_000  # estimates a second, IMU messages a minute
ERRORS = 0.01  # in place of what the estimator leaves of a sample


class Cost(NamedTuple):
    """Largest memory, MB, after a minute's replay, after all was kept, after all was written; and what was written."""

    minute_mb: float
    kept_mb: float
    written_mb: float
    files_mb: float
    processor_s: float


def measured(hours: float) -> Cost:
    """The cost of so many hours, in this process."""
    aircraft, minutes = load_aircraft("cdrw"), round(60 * hours)
    done = replay(load(FLIGHT, aircraft), {"publish_rate": float(RATE)})
    first = _memory()
    estimates = list(done.history[10 * RATE :])[: 48 * RATE]
    alignment, history, stamps = PieceAlignment(aircraft, 0.2, "auto"), EstimatesLog(), array("q")
    samples = RecordedSamples(aircraft, minutes * SAMPLES)
    for minute, piece in enumerate(_pieces(minutes)):
        aligned = alignment.take(piece, last=minute == minutes - 1)
        samples.add(aligned.time, aligned.samples, np.full((aligned.time.size, 3), ERRORS))
        for k in range(60 * RATE):
            now = 60.0 * minute + k / RATE
            history.append(replace(estimates[k % len(estimates)], time=now))
            stamps.append(round(1e9 * now) + 1)
    kept = _memory()
    final = replace(done.final, time=60.0 * minutes)
    long = replace(done, samples=samples, history=history, stamps_ns=np.array(stamps, np.int64), final=final)
    with tempfile.TemporaryDirectory(prefix="sysid-long-") as folder:
        long.write(Path(folder))
        size = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file())
    return Cost(first, kept, _memory(), size / 1e6, time.process_time())


def _pieces(minutes: int) -> Iterator[Streams]:
    """The flight's messages, a minute later each time."""
    streams = read_streams(FLIGHT)
    count = sum(len(stream.arrival) for stream in streams.by_topic.values())
    for minute in range(minutes):
        moved = []
        for one in (streams.imu, streams.air_data, streams.actuators):
            was = one.arrival
            later = replace(
                was,
                stamp_ns=was.stamp_ns + minute * MINUTE,
                log_ns=was.log_ns + minute * MINUTE,
                order=was.order + minute * count,
            )
            moved.append(replace(one, arrival=later))
        yield replace(streams, imu=moved[0], air_data=moved[1], actuators=moved[2])


def _memory() -> float:
    """The largest resident memory of this process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def main() -> None:
    """Print the table, or put it in the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, nargs="+", default=[1.0, 3.0, 6.0])
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    rows = []
    for hours in args.hours:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            cost = pool.apply(measured, (hours,))
        rows.append([f"{hours:g}", *(f"{value:.0f}" for value in cost)])
    heads = ("hours", "a minute replayed, MB", "all kept, MB", "all written, MB", "files, MB", "processor, s")
    publish("bench/speed/long_results.py", table(heads, rows), args.page)


if __name__ == "__main__":
    main()
