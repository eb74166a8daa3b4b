"""The closed loop under stress, over DDS.

    python -m bench.closed_loop.stress --page docs/results/closed_loop.md

Every node of the loop runs in a process of its own, and all that the sensors say passes through a relay. One after
other: each node is killed and started again, 30 % of the messages are lost, each is up to 50 ms late, each sensor is
silent for 2 s, the clock steps back. Of each: how soon /diagnostics says so and which node, the worst error of pitch
and roll, and how long after it is over all is as before. `--minutes 10` flies undisturbed instead and looks at memory,
processor time and lateness. Figures depend on the machine: the load while they were measured stands below them.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import heapq
import math
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bench.pages import publish, table
from sysid_node.cli.live.ros_domain import own_domain

RAW = ("imu/data", "air_data", "actuators")
NODES: Mapping[str, tuple[str, ...]] = {
    "flight_simulator": (),
    "identifier": ("method:=sls_rft",),
    "exciter": (),
    "fault_monitor": (),
    "adaptive_controller": (),
}
BEFORE, LASTING, PATIENCE = 4.0, 6.0, 40.0  # s: quiet flight before, a lasting disturbance, most for a recovery
TRACKS = 0.05  # rad within which it flies as before, for SETTLED s
SETTLED = 2.0
LOST = 1.0  # rad


class Relay:
    """Passes the sensors' messages on: lost, late, silent, or stamped otherwise."""

    def __init__(self, node: Any) -> None:
        from sensor_msgs.msg import Imu, JointState  # noqa: PLC0415  # after the domain is set
        from sysid_msgs.msg import AirData  # noqa: PLC0415

        from sysid_node.flight.live.arrivals import Arrivals  # noqa: PLC0415
        from sysid_node.ros.support.loop_node import SENSOR_QOS  # noqa: PLC0415

        self.heard = {topic: Arrivals(topic, 1.0) for topic in RAW}
        self.told: list[list[str]] = []  # of every second, what was wrong with what the simulator sent
        self._second = time.monotonic()
        self.drop, self.jitter, self.shift_ns, self.silent = 0.0, 0.0, 0, ""
        self._random, self._order = random.Random(1), 0
        self._waiting: list[tuple[float, int, Any, Any]] = []
        for kind, topic in zip((Imu, AirData, JointState), RAW, strict=True):
            to = node.create_publisher(kind, topic, 200)
            node.create_subscription(kind, f"raw/{topic}", self._passing(topic, to), SENSOR_QOS)

    def flush(self) -> None:
        """Send what is due."""
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            _, _, to, message = heapq.heappop(self._waiting)
            to.publish(message)

    def listen(self) -> None:
        """Once a second, note how what came has come."""
        if time.monotonic() - self._second >= 1.0:
            self._second = time.monotonic()
            self.told.append([words for one in self.heard.values() for words in one.troubles()])

    def _passing(self, topic: str, to: Any) -> Callable[[Any], None]:
        from sysid_node.ros.support.conversion import stamp_message, stamp_ns  # noqa: PLC0415

        def take(message: Any) -> None:
            self.heard[topic].arrived(1e-9 * stamp_ns(message.header.stamp))
            if topic == self.silent or self._random.random() < self.drop:
                return
            if self.shift_ns:
                message.header.stamp = stamp_message(stamp_ns(message.header.stamp) + self.shift_ns)
            self._order += 1
            due = time.monotonic() + self._random.random() * self.jitter if self.jitter else 0.0
            heapq.heappush(self._waiting, (due, self._order, to, message))
            self.flush()

        return take


@dataclass
class Loop:
    """The processes, and what is heard of them."""

    watch: Any
    relay: Relay
    executor: Any
    logs: Path
    processes: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)
    killed: set[str] = field(default_factory=set)
    said: list[tuple[float, str, str]] = field(default_factory=list)  # s, node, words

    def begin(self, name: str) -> None:
        """Start a node, anew where it was."""
        self.killed.discard(name)
        words = [word for pair in ("aircraft:=cdrw", *NODES[name]) for word in ("-p", pair)]
        if name == "flight_simulator":
            words += [word for topic in RAW for word in ("-r", f"{topic}:=raw/{topic}")]
        command = [sys.executable, "-m", f"sysid_node.ros.{name}", "--ros-args", *words]
        with (self.logs / f"{name}.log").open("ab") as log:
            self.processes[name] = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)

    def kill(self, name: str) -> None:
        """As a crash would."""
        self.killed.add(name)
        self.processes[name].kill()
        self.processes[name].wait()

    def run(self, seconds: float) -> None:
        """Fly on, asking for roll and pitch."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for name, process in self.processes.items():
                if process.poll() is not None and name not in self.killed:
                    raise SystemExit(f"{name} died with code {process.returncode}; see {self.logs / name}.log")
            phase = int(time.monotonic() / 3.0) % 4
            self.watch.ask_for({"roll": (0.2, 0.0, -0.2, 0.0)[phase], "pitch": (0.12, 0.08, 0.05, 0.08)[phase]})
            self.relay.listen()
            begun = time.monotonic()
            while time.monotonic() < min(begun + 0.1, end):
                self.executor.spin_once(timeout_sec=0.002)
                self.relay.flush()

    def hear(self, message: Any) -> None:
        """Keep what nodes say of themselves."""
        for status in message.status:
            self.said.append((time.monotonic(), status.name.partition(":")[0], status.message))

    def errors(self, since: int) -> Any:
        """(N, 2) of pitch and roll, rad, of the tracking's rows from one on; NaN: not measured."""
        rows = [[row["pitch error"], row["roll error"]] for _, row in self.watch.tracking[since:] if row]
        return np.array(rows).reshape(-1, 2)

    def tracks(self) -> bool:
        """Whether it flies as before."""
        rows = [(t, row) for t, row in self.watch.tracking[-round(400 * SETTLED) :] if row]
        if not rows or rows[-1][0] - rows[0][0] < 0.5 * SETTLED:
            return False
        errors = self.errors(-round(200 * SETTLED))
        return bool(np.isfinite(errors).all() and np.abs(errors).max() < TRACKS)


@contextlib.contextmanager
def flying() -> Iterator[Loop]:
    """The loop under way; killed at the end."""
    gc.disable()  # what is kept of the flight grows: looking through it would hold the sensors' messages up for 50 ms
    own_domain()
    import rclpy  # noqa: PLC0415  # reads its domain from the environment
    from diagnostic_msgs.msg import DiagnosticArray  # noqa: PLC0415
    from rclpy.experimental import EventsExecutor  # noqa: PLC0415

    from sysid_node.ros.support.loop_watch import LoopWatch  # noqa: PLC0415

    rclpy.init()
    node = rclpy.create_node("relay")
    executor = EventsExecutor()
    executor.add_node(node)
    logs = Path(tempfile.mkdtemp(prefix="loop_stress_"))
    loop = Loop(LoopWatch(executor), Relay(node), executor, logs)
    node.create_subscription(DiagnosticArray, "/diagnostics", loop.hear, 100)
    try:
        for name in NODES:
            loop.begin(name)
        until(loop, loop.tracks, 120.0)
        yield loop
    finally:
        for process in loop.processes.values():
            process.kill()
            process.wait()
        loop.watch.close()
        node.destroy_node()
        rclpy.try_shutdown()


def until(loop: Loop, condition: Callable[[], bool], patience: float) -> float:
    """Fly on until the condition holds; the seconds it took, infinite where it never did."""
    begun = time.monotonic()
    while not condition():
        if time.monotonic() - begun > patience:
            return math.inf
        loop.run(0.1)
    return time.monotonic() - begun


def event(loop: Loop, name: str, words: str, during: Callable[[], None]) -> list[str]:
    """One disturbance; ``words`` is what some node should say of it."""
    until(loop, loop.tracks, PATIENCE)
    loop.run(BEFORE)
    rows, heard, begun = len(loop.watch.tracking), len(loop.said), time.monotonic()
    during()
    ended = time.monotonic()
    loop.run(1.5)  # the words are said once a second
    until(loop, loop.tracks, PATIENCE)
    took = time.monotonic() - ended
    found = [(t - begun, node) for t, node, line in loop.said[heard:] if re.search(words, line)]
    told = [f"{found[0][0]:.1f}", found[0][1]] if found else ["never", "-"]
    errors = np.abs(loop.errors(rows))
    worst = math.degrees(float(np.nanmax(errors))) if errors.size else math.nan
    flown = "lost" if worst > math.degrees(LOST) else f"{worst:.1f}"
    return [name, f"{ended - begun:.1f}", *told, flown, f"{took:.1f}" if loop.tracks() else "never"]


def stress() -> str:
    """The table of disturbances."""
    with flying() as loop:
        rows = [event(loop, *one) for one in _deaths(loop)]
        rows += [event(loop, *one) for one in _troubles(loop)]
        skipped = _skipped(loop)
    heads = ("it lasts, s", "said after s", "by", "worst error, deg", "as before after s")
    return table(("what happens", *heads), rows) + f"\n\n{skipped} {_machine()}"


def _skipped(loop: Loop) -> str:
    flown = loop.watch.value("flight_simulator", "not flown (s)")
    return f"Not flown because the machine was too slow: {float(flown or 0.0):.1f} s since the simulator's last start."


def _deaths(loop: Loop) -> Iterator[tuple[str, str, Callable[[], None]]]:
    words = {
        "flight_simulator": "imu/data (was )?silent",
        "identifier": "no estimates for|derivatives (was )?silent",
        "exciter": "excitation (was )?silent",
        "fault_monitor": "learns what sound flight is like",
        "adaptive_controller": "no commands on",
    }
    for name in NODES:

        def die(name: str = name) -> None:
            loop.kill(name)
            loop.run(1.0)
            heard = len(loop.said)
            loop.begin(name)
            until(loop, lambda: any(node == name for _, node, _ in loop.said[heard:]), PATIENCE)

        yield f"{name} killed, started again after 1 s", words[name], die


def _troubles(loop: Loop) -> Iterator[tuple[str, str, Callable[[], None]]]:
    def changed(name: str, value: Any, seconds: float, back: Any) -> Callable[[], None]:
        def during() -> None:
            setattr(loop.relay, name, value)
            loop.run(seconds)
            setattr(loop.relay, name, back)

        return during

    yield "30 % of the sensors' messages lost", r"% lost", changed("drop", 0.3, LASTING, 0.0)
    yield "each up to 50 ms late", r"ms late|out of order", changed("jitter", 0.05, LASTING, 0.0)
    for topic in RAW:
        yield f"{topic} silent", rf"{topic}[^;]* silent|not measured", changed("silent", topic, 2.0, "")
    yield "clock steps back by 5 s", r"clock set", changed("shift_ns", -5_000_000_000, LASTING, -5_000_000_000)
    yield "clock steps ahead again", r"clock set|no estimates", changed("shift_ns", 0, LASTING, 0)


def endure(minutes: float) -> str:
    """The table of memory and lateness, from the time on that all fly."""
    with flying() as loop:
        said, told = len(loop.said), len(loop.relay.told)
        loop.run(30.0)
        loop.watch.excite()
        loop.run(30.0)
        first, used, begun = {n: _memory(p.pid) for n, p in loop.processes.items()}, _seconds(loop), time.monotonic()
        loop.run(60.0 * (minutes - 1.0))
        passed, now = time.monotonic() - begun, _seconds(loop)
        rows = []
        for name, process in loop.processes.items():
            share = 100.0 * (now[name] - used[name]) / passed
            memory = [f"{first[name]:.1f}", f"{_memory(process.pid):.1f}"]
            late = _lateness([line for _, node, line in loop.said[said:] if node == name])
            rows.append([name, *memory, f"{share:.0f}", late, _slowest(loop, name)])
        heard = loop.relay.told[told:]
        ours = f"The relay was late itself, or heard what was, in {sum(map(bool, heard))} of {len(heard)} seconds."
        notes = f"{ours} {_skipped(loop)} {_machine()}"
    heads = ("MB after a minute", "MB at the end", "processor, %", "times lateness was said", "step p99, ms")
    return table(("node", *heads), rows) + f"\n\n{notes}"


def _lateness(said: list[str]) -> str:
    """How often a node said that something was late, lost or silent."""
    late = [line for line in said if re.search(r"\blate\b|lost|silent|not flown|no commands|behind", line)]
    return f"{len(late)} of {len(said)}{_what(late)}"


def _what(late: list[str]) -> str:
    """Which topics were late, lost or silent, and how often that was said of each."""
    found = Counter(
        topic for line in late for topic in set(re.findall(r"([\w/]+) (?:up to|\d+ %|was silent|silent)", line))
    )
    return f" ({', '.join(f'{topic} {count}' for topic, count in found.most_common())})" if found else ""


def _slowest(loop: Loop, name: str) -> str:
    for key in ("step p99 (us)", "update p99 (us)"):
        value = loop.watch.value(name, key)
        if value:
            return f"{1e-3 * float(value):.1f}"
    return "-"


def _memory(pid: int) -> float:
    """Resident, MB."""
    text = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    return int(re.findall(r"VmRSS:\s+(\d+)", text)[0]) / 1024.0


def _seconds(loop: Loop) -> dict[str, float]:
    """Processor time used so far."""
    ticks = os.sysconf("SC_CLK_TCK")
    found = {}
    for name, process in loop.processes.items():
        fields = Path(f"/proc/{process.pid}/stat").read_text(encoding="utf-8").rpartition(") ")[2].split()
        found[name] = (int(fields[11]) + int(fields[12])) / ticks
    return found


def _machine() -> str:
    one, five, _ = os.getloadavg()
    return (
        f"On {os.cpu_count()} cores, with a load of {one:.0f} (over five minutes {five:.0f}), this flight's included."
    )


def main() -> None:
    """Print the table, or put it in the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=0.0, help="fly undisturbed for so long instead")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    if args.minutes:
        publish("bench/closed_loop/stress.py --minutes", endure(max(args.minutes, 2.0)), args.page)
    else:
        publish("bench/closed_loop/stress.py", stress(), args.page)


if __name__ == "__main__":
    main()
