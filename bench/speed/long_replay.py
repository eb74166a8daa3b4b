"""Memory and processor time of `sysid replay` of ten minutes, an hour and six hours at 200 Hz.

    python -m bench.speed.long_replay [--hours 0.1667 1 6] [--storage mcap] [--page docs/results/cost.md]

The bag is a bundled flight, flown again and again: the messages of `bags/cdrw_multistep` (IMU and actuators at 200 Hz,
air data at 100 Hz), stamped a minute later each time. The command runs in a process of its own, whose largest resident
memory and processor time the system counts; both include the report, the tables and the bag of all estimates.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from bench.pages import publish, table
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import add_topic, air_data_messages, imu_messages, joint_messages, new_bag
from sysid_node.flight.streams import Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU, INPUT_TOPICS, topic_names

ROOT = Path(__file__).resolve().parents[2]
FLIGHT = ROOT / "bags" / "cdrw_multistep"
MINUTE = 60_000_000_000  # ns


class Cost(NamedTuple):
    """What a replay of so many hours took."""

    hours: float
    messages: int
    estimates_mb: float
    memory_mb: float
    processor_s: float


def write_long(path: Path, minutes: int, storage: str) -> int:
    """A bag of so many minutes; returns the number of its messages."""
    streams, count = read_streams(FLIGHT), 0
    with new_bag(path, storage) as writer:
        topics = topic_names()
        connections = {topic: add_topic(writer, topics[topic], INPUT_TOPICS[topic]) for topic in INPUT_TOPICS}
        for minute in range(minutes):
            for log_ns, topic, data in _minute(streams, minute * MINUTE):
                writer.write(connections[topic], log_ns, data)
                count += 1
    return count


def _minute(streams: Streams, later: int) -> Iterator[tuple[int, str, bytes]]:
    """The messages of the flight in order, ``later`` by so many ns; those of its last instant are left out."""
    end = int(streams.imu.arrival.log_ns[0]) + MINUTE - 1_000_000
    moved = [
        replace(s, arrival=replace(s.arrival, stamp_ns=s.arrival.stamp_ns + later))
        for s in (streams.imu, streams.air_data, streams.actuators)
    ]
    messages = (imu_messages(moved[0], "flu"), air_data_messages(moved[1]), joint_messages(moved[2]))
    rows = [
        (order, log_ns, topic, data)
        for stream, topic, some in zip(moved, (IMU, AIR_DATA, ACTUATORS), messages, strict=True)
        for order, log_ns, data in zip(stream.arrival.order.tolist(), stream.arrival.log_ns.tolist(), some, strict=True)
        if log_ns < end
    ]
    for _, log_ns, topic, data in sorted(rows, key=lambda row: row[0]):
        yield log_ns + later, topic, data


def measured(hours: float, storage: str, folder: Path) -> Cost:
    """The cost of a replay; what is written is removed again."""
    bag, out = folder / "bag", folder / "out"
    messages = write_long(bag, round(60 * hours), storage)
    words = ["replay", str(bag), "--aircraft", "cdrw", "--out", str(out), "--quiet"]
    process = subprocess.Popen([sys.executable, "-m", "sysid_node.cli", *words], cwd=ROOT)
    _, status, used = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"sysid replay ended with {os.waitstatus_to_exitcode(status)}")
    written = sum(file.stat().st_size for file in (out / "estimates").iterdir())
    return Cost(hours, messages, written / 1e6, used.ru_maxrss * 1024 / 1e6, used.ru_utime + used.ru_stime)


def main() -> None:
    """Print the table, or put it in the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, nargs="+", default=[1.0 / 6.0, 1.0, 6.0])
    parser.add_argument("--storage", default="mcap")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    rows = []
    for hours in args.hours:
        with tempfile.TemporaryDirectory(prefix="sysid-long-") as name:
            cost = measured(hours, args.storage, Path(name))
        print(cost, file=sys.stderr, flush=True)
        rows.append(
            [
                f"{60 * cost.hours:.0f}",
                f"{cost.messages / 1e6:.2f}",
                f"{cost.memory_mb:.0f}",
                f"{cost.processor_s:.0f}",
                f"{cost.processor_s / (3600 * cost.hours) * 1e3:.0f}",
                f"{cost.estimates_mb:.0f}",
            ]
        )
    heads = ("minutes", "messages, millions", "memory, MB", "processor, s", "ms a second of flight", "estimates, MB")
    publish("bench/speed/long_replay.py", table(heads, rows), args.page)


if __name__ == "__main__":
    main()
