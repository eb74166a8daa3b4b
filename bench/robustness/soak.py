"""A day's flight through the identifier, over DDS by /clock: memory, time, and whether estimates drift.

    python -m bench.robustness.soak [--hours 24] [--speed 1] [--minutes 90] [--page docs/results/soak.md]

The node runs in a process of its own with `use_sim_time`. This program is the flight: it publishes IMU messages at
200 Hz, air data and actuators at 50 Hz, and /clock, as fast as the node takes them, which it tells by the node's
estimates; `--speed 1` flies in real time. The flight repeats every minute to the last bit, its noise included, and the
node's memory fades within a minute. The surfaces are exactly on time: were phases or times to drift, the estimated
times of the servos would leave zero, and intervals would cease to hold the truth. `--minutes` ends it by the clock on
the wall.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bench.pages import publish, table
from bench.robustness.periodic_flight import PERIOD, RATE, Messages, fly, serialised, stamp_of, stamped
from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.live.ros_domain import own_domain

ESTIMATES, FORGETTING = 2, 60.0  # Hz, s
SERVOS = ("aileron", "rudder")  # the elevator moves too little here for its time to be known at every moment
CLOCK_EVERY = 20  # IMU messages
AHEAD = 0.75  # s of flight by which it may be ahead of the node's estimates, less than the node's queues hold
PATIENCE = 5.0  # s without an estimate, after which messages count as lost
START = 1_700_000_000 * 10**9  # ns
HOUR = 3600


class Hour(NamedTuple):
    """What is known after an hour of flight."""

    hours: float
    wall: float  # s since the one before
    processor: float  # s of the node since the one before
    resident: float  # MB of the node
    late: dict[str, float]  # s: median estimate of the lateness of each servo, in the last minute
    valid: int  # valid estimates in the last minute
    hold: int  # of these, those whose interval holds the truth


@dataclass
class Heard:
    """The node's estimates."""

    stamp: int = 0  # of the last
    count: int = 0
    off: float = 0.0  # s, largest distance of a stamp from the time at which estimates fall due
    last_minute: deque[bytes] = field(default_factory=lambda: deque(maxlen=PERIOD * ESTIMATES))  # messages
    diagnostics: dict[str, int] = field(default_factory=dict)  # worst level of each status

    def take(self, data: bytes) -> None:
        """Take serialised estimates."""
        stamp = stamp_of(data)
        self.stamp, self.count = stamp, self.count + 1
        self.last_minute.append(data)
        self.off = max(self.off, abs((stamp - START) / 1e9 - round((stamp - START) * ESTIMATES / 1e9) / ESTIMATES))


class Flight:
    """Publishes the flight, and hears what the node makes of it."""

    def __init__(self, messages: Messages, speed: float) -> None:
        import rclpy  # noqa: PLC0415
        from builtin_interfaces.msg import Time  # noqa: PLC0415
        from diagnostic_msgs.msg import DiagnosticArray  # noqa: PLC0415
        from rclpy.experimental import EventsExecutor  # noqa: PLC0415
        from rclpy.qos import QoSProfile, ReliabilityPolicy  # noqa: PLC0415
        from rosgraph_msgs.msg import Clock  # noqa: PLC0415
        from sensor_msgs.msg import Imu, JointState  # noqa: PLC0415
        from sysid_msgs.msg import AirData, DerivativeEstimates  # noqa: PLC0415

        rclpy.init()
        self.node, self.messages, self.speed = rclpy.create_node("flight"), messages, speed
        self.heard, self.losses, self.sent, self._begun = Heard(), 0, 0, 0.0
        qos = QoSProfile(depth=200, reliability=ReliabilityPolicy.RELIABLE)
        kinds = ((Imu, "imu/data"), (AirData, "air_data"), (JointState, "actuators"))
        self.outputs = [self.node.create_publisher(kind, topic, qos) for kind, topic in kinds]
        self.clock = self.node.create_publisher(Clock, "/clock", 10)
        self._clock = lambda ns: Clock(clock=Time(sec=ns // 10**9, nanosec=ns % 10**9))
        self.node.create_subscription(DerivativeEstimates, "identifier/derivatives", self.heard.take, 50, raw=True)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self.executor = EventsExecutor()
        self.executor.add_node(self.node)

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            level = status.level[0]
            if self.heard.count > 1800 * ESTIMATES:
                self.heard.diagnostics[status.name] = max(level, self.heard.diagnostics.get(status.name, 0))

    def wait_for_node(self) -> None:
        """Until the node listens."""
        while not all(output.get_subscription_count() for output in (*self.outputs, self.clock)):
            self.executor.spin_once(timeout_sec=0.05)
        time.sleep(1.0)
        self._begun = time.monotonic()

    def period(self, number: int) -> None:
        """Fly one period; the node's estimates are those of its last samples then."""
        start = START + number * PERIOD * 10**9
        outputs = [output.publish for output in self.outputs]
        for topic, tick, data in zip(*self.messages, strict=True):
            stamp = start + tick * (10**9 // RATE)
            if topic == 0 and tick % CLOCK_EVERY == 0:
                self._keep_pace(stamp)
                self.clock.publish(self._clock(stamp))
            outputs[topic](stamped(data, stamp))
        self.sent += len(self.messages.data)

    def _keep_pace(self, stamp: int) -> None:
        """Wait until the node, and the clock where a speed is given, are there."""
        due = self._begun + (stamp - START) / 1e9 / self.speed
        while self.speed < math.inf and time.monotonic() < due:
            self.executor.spin_once(timeout_sec=max(0.0, min(due - time.monotonic(), 0.02)))
        self.executor.spin_once(timeout_sec=0.0)
        end = time.monotonic() + PATIENCE
        while stamp - max(self.heard.stamp, START + 10**9) > AHEAD * 1e9:
            self.executor.spin_once(timeout_sec=0.02)
            if time.monotonic() > end:
                self.losses += 1
                return


def processor_seconds(pid: int) -> float:
    """Processor time that a process has used, s (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident(pid: int) -> float:
    """Memory that a process holds, MB (Linux)."""
    return int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]) * 4096 / 1e6


def estimated(data: Iterable[bytes], truth: Mapping[str, float]) -> tuple[dict[str, float], int, int]:
    """The median lateness (s) of each servo in serialised estimates; how many are valid, and how many of these hold."""
    from rclpy.serialization import deserialize_message  # noqa: PLC0415
    from sysid_msgs.msg import DerivativeEstimates  # noqa: PLC0415

    messages = [deserialize_message(one, DerivativeEstimates) for one in data]
    late = {name: [s.value for m in messages for s in m.servos if s.name == name] for name in SERVOS}
    valid = [one for message in messages for one in message.derivatives if one.valid]
    hold = sum(one.lower <= truth[one.name] <= one.upper for one in valid)
    return {name: float(np.median(values)) for name, values in late.items() if values}, len(valid), hold


class Node:
    """The identifier, in a process of its own."""

    def __init__(self) -> None:
        words = [f"publish_rate:={ESTIMATES}.0", f"forgetting_time:={FORGETTING}", "use_sim_time:=true"]
        parameters = [word for one in ("aircraft:=cdrw", *words) for word in ("-p", one)]
        command = [sys.executable, "-m", "sysid_node.ros.identifier", "--ros-args", *parameters]
        self.log = tempfile.TemporaryFile()  # noqa: SIM115  # closed when the node ends
        self.process = subprocess.Popen(command, stderr=self.log)
        self._wall, self._used = time.monotonic(), 0.0

    def begin(self) -> None:
        """Count from now on."""
        self._wall, self._used = time.monotonic(), processor_seconds(self.process.pid)

    def hour(self, hours: float, found: tuple[dict[str, float], int, int]) -> Hour:
        """The figures since the last count."""
        wall, used, pid = self._wall, self._used, self.process.pid
        self.begin()
        return Hour(hours, self._wall - wall, self._used - used, resident(pid), *found)

    def end(self) -> None:
        """End it, and show what it said."""
        self.process.terminate()
        self.process.wait()
        self.log.seek(0)
        print(self.log.read().decode()[-3000:], file=sys.stderr)
        self.log.close()


def soak(hours: float, speed: float, minutes: float, every: float) -> tuple[list[Hour], Flight]:
    """The figures of each ``every`` hours, and the flight with what was heard."""
    aircraft = load_aircraft("cdrw")
    truth = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    flight, node = Flight(serialised(aircraft, fly(aircraft, 1)), speed), Node()
    rows: list[Hour] = []
    end, next_row = time.monotonic() + 60.0 * minutes, every
    try:
        flight.wait_for_node()
        node.begin()
        for number in range(round(hours * HOUR / PERIOD)):
            flight.period(number)
            flown, over = (number + 1) * PERIOD / HOUR, time.monotonic() > end
            if flown + 1e-9 >= next_row or over:
                next_row += every
                rows.append(node.hour(flown, estimated(flight.heard.last_minute, truth)))
                print(rows[-1], flight.losses, file=sys.stderr, flush=True)
            if over:
                break
    finally:
        node.end()
    return rows, flight


def text(rows: list[Hour], flight: Flight) -> str:
    """The table and a line on the whole."""
    late = [f"{name} late, ms" for name in SERVOS]
    heads = ("hours of flight", "it took, min", "node, us a sample", "memory, MB", *late, "valid", "of these hold")
    lines, before = [], 0.0
    for row in rows:
        samples = (row.hours - before) * HOUR * RATE
        before = row.hours
        cells = [f"{row.hours:.1f}", f"{row.wall / 60:.1f}", f"{1e6 * row.processor / samples:.0f}"]
        cells += [f"{row.resident:.1f}", *(f"{1e3 * row.late.get(name, math.nan):+.2f}" for name in SERVOS)]
        lines.append([*cells, f"{row.valid / (PERIOD * ESTIMATES):.1f}", f"{row.hold / max(row.valid, 1):.1%}"])
    heard = flight.heard
    levels = ", ".join(f"{name} {('OK', 'WARN', 'ERROR', 'STALE')[level]}" for name, level in heard.diagnostics.items())
    expected = round(rows[-1].hours * HOUR * ESTIMATES)
    grown = rows[-1].resident - rows[0].resident
    return (
        f"{table(heads, lines)}\n\n{flight.sent} messages, {heard.count} estimates where {expected} fall due, "
        f"at most {heard.off:.3f} s from when they do; {flight.losses} waits in vain. "
        f"Memory after the first row grew by {grown:.1f} MB. Worst levels on /diagnostics: {levels}."
    )


def main() -> None:
    """Print the table, or put it in the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--speed", type=float, default=math.inf, help="times real time; as fast as it goes if left out")
    parser.add_argument("--minutes", type=float, default=math.inf, help="by the clock on the wall, at most")
    parser.add_argument("--every", type=float, default=2.0, help="hours of flight between rows")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    own_domain()
    rows, flight = soak(args.hours, args.speed, args.minutes, args.every)
    name = "bench/robustness/soak.py" + (f" --speed {args.speed:g}" if args.speed < math.inf else "")
    publish(name, text(rows, flight), args.page)


if __name__ == "__main__":
    main()
