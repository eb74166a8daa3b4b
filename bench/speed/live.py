"""The live node at work: what is lost, how late estimates are, what it costs.

    python -m bench.speed.live [--seconds 60]

One process publishes 400 Hz IMU, 100 Hz air data and 100 Hz actuators, another is the identifier, this one listens.
Latency is from the IMU message's header stamp to the estimate's publication, as DDS stamps it, and to its arrival here,
one DDS hop and one callback later.
Inputs are interpolated, so a sample waits until air data and actuators of its own time or later have come. Where all
three are sampled together that takes no time; where they are stamped apart, the freshest sample that is complete is an
IMU interval old, 2.5 ms here.
The bare node is what ROS itself takes: an rclpy node that hears the same messages and answers every eighth IMU message
with an empty message of estimates at once.
"""

import argparse
import contextlib
import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData, DerivativeEstimates  # found once sysid_node.ros is there

from sysid_node.ros.support.conversion import stamp_message, stamp_ns
from sysid_node.ros.support.spin import run_program, serve

IMU_RATE, SLOW_EVERY = 400, 4
PUBLISH_RATE = 50.0


def fly(seconds: float, together: bool) -> None:
    """``publish`` in a process of its own."""
    sys.exit(run_program(lambda: publish(seconds, together)))


def publish(seconds: float, together: bool) -> None:
    """Publish a made-up, well excited flight, each message stamped when it is published."""
    node = rclpy.create_node("flight")
    qos = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    imu, air, joints = (
        node.create_publisher(kind, topic, qos)
        for kind, topic in ((Imu, "imu/data"), (AirData, "air_data"), (JointState, "actuators"))
    )
    while not all(publisher.get_subscription_count() for publisher in (imu, air, joints)):
        time.sleep(0.05)
    time.sleep(0.5)
    start = time.monotonic()
    for tick in range(int(seconds * IMU_RATE) + 1):
        t = tick / IMU_RATE
        slow = [(air, air_data(t)), (joints, deflections(t))] if tick % SLOW_EVERY == 0 else []
        fast = motion(t)
        time.sleep(max(0.0, start + t - time.monotonic()))
        stamp = stamp_message(time.time_ns())
        for publisher, message in slow:
            message.header.stamp = stamp
            publisher.publish(message)
        fast.header.stamp = stamp if together else stamp_message(time.time_ns())
        imu.publish(fast)


def motion(t):
    message = Imu()
    message.linear_acceleration.x, message.linear_acceleration.z = 0.1 * math.sin(t), 9.8 + math.sin(2.0 * t)
    rates = message.angular_velocity
    rates.x, rates.y, rates.z = 0.3 * math.sin(3.0 * t), 0.2 * math.cos(2.0 * t), 0.1 * math.sin(2.5 * t)
    return message


def air_data(t):
    return AirData(
        true_airspeed=18.0 + 0.5 * math.sin(0.7 * t),
        angle_of_attack=0.05 + 0.03 * math.sin(2.0 * t),
        sideslip=0.03 * math.sin(2.5 * t),
        air_density=1.2,
    )


def deflections(t):
    surfaces = [0.05 * math.sin(3.1 * t), 0.05 * math.sin(2.3 * t), 0.05 * math.cos(1.9 * t)]
    return JointState(name=["elevator", "aileron", "rudder", "throttle"], position=[*surfaces, 0.5])


class BareNode(Node):
    """Hears what the identifier hears, and answers as often, without doing anything."""

    def __init__(self) -> None:
        super().__init__("identifier")
        self.heard = 0
        self.answers = self.create_publisher(DerivativeEstimates, "~/derivatives", 10)
        qos = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.create_subscription(Imu, "imu/data", self.answer, qos)
        for kind, topic in ((AirData, "air_data"), (JointState, "actuators")):
            self.create_subscription(kind, topic, lambda message: None, qos)

    def answer(self, message) -> None:
        """Every eighth message is answered."""
        self.heard += 1
        if self.heard % round(IMU_RATE / PUBLISH_RATE) == 0:
            self.answers.publish(DerivativeEstimates(header=message.header))


def run_bare() -> None:
    """The bare node until it is told to stop."""
    sys.exit(run_program(lambda: serve(BareNode())))


@contextlib.contextmanager
def started(bare: bool) -> Iterator[subprocess.Popen]:
    """The identifier, or the bare node, in a process of its own."""
    command = [sys.executable, "-m", "sysid_node.ros.identifier", "--ros-args", "--log-level", "warn"]
    command += ["-p", "aircraft:=cdrw", "-p", f"publish_rate:={PUBLISH_RATE}"]
    process = subprocess.Popen([sys.executable, "-m", "bench.speed.live", "--bare-node"] if bare else command)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def processor_seconds(pid: int) -> float:
    """Processor time that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def listen(node, flight: BaseProcess, pid: int, bare: bool) -> tuple[list[tuple[int, int]], dict[str, str], float]:
    """Start the flight once the node's topics are there, and listen to its end.

    Latencies (ns) until publication and arrival, last words of /diagnostics by key, the node's share of a core.
    """
    latencies: list[tuple[int, int]] = []
    words: dict[str, str] = {}
    used = began = 0.0

    def on_estimates(message, info) -> None:
        nonlocal used, began
        stamp = stamp_ns(message.header.stamp)
        latencies.append((info["source_timestamp"] - stamp, time.time_ns() - stamp))
        if not began:
            used, began = processor_seconds(pid), time.monotonic()

    def on_diagnostics(message) -> None:
        words.update({pair.key: pair.value for status in message.status for pair in status.values})

    heard = (
        node.create_subscription(DerivativeEstimates, "/identifier/derivatives", on_estimates, 100),
        node.create_subscription(DiagnosticArray, "/diagnostics", on_diagnostics, 10),
    )
    executor = SingleThreadedExecutor()  # the events executor gives callbacks no message info
    executor.add_node(node)
    # what is published before this program is known to the node would not reach it
    while not all(subscription.get_publisher_count() for subscription in heard[: 1 if bare else 2]):
        executor.spin_once(timeout_sec=0.05)
    flight.start()
    while flight.is_alive():
        executor.spin_once(timeout_sec=0.2)
    share = (processor_seconds(pid) - used) / (time.monotonic() - began)
    end = time.monotonic() + 1.5  # diagnostics come once a second
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.2)
    executor.shutdown()
    return latencies, words, share


def main() -> None:
    """Entry point of the bench, and of the bare node that it starts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--bare-node", action="store_true", help="be the bare node (what the bench starts)")
    options = parser.parse_args()
    if options.bare_node:
        run_bare()
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    sys.exit(run_program(lambda: measure_all(options.seconds)))


def measure_all(seconds: float) -> None:
    """Measure both nodes under both kinds of sampling and print the table."""
    print(f"{seconds:g} s of {IMU_RATE} Hz IMU + 100 Hz air data + 100 Hz actuators, estimates at {PUBLISH_RATE:g} Hz")
    print(
        f"{'node':<12}{'sampling':<10}{'sent':>8}{'lost':>6}{'rejected':>10}{'estimates':>11}"
        f"{'published: p50 ms':>19}{'p99 ms':>8}{'arrived: p50 ms':>17}{'p99 ms':>8}{'CPU %':>7}"
    )
    for bare, together in ((True, True), (False, True), (False, False)):
        measure(seconds, bare, together)


def measure(seconds: float, bare: bool, together: bool) -> None:
    """One node under one kind of sampling: a line of the table."""
    node = rclpy.create_node("bench")
    flight = get_context("spawn").Process(target=fly, args=(seconds, together), daemon=True)
    with started(bare) as process:
        latencies, words, share = listen(node, flight, process.pid, bare)
    node.destroy_node()
    ticks = int(seconds * IMU_RATE) + 1
    sent, lost, rejected = ticks + 2 * (1 + (ticks - 1) // SLOW_EVERY), "", ""
    if not bare:
        received = sum(int(words[f"{topic}: received"]) for topic in ("imu/data", "air_data", "actuators"))
        lost = str(sent - received)
        rejected = str(sum(int(count) for key, count in words.items() if key.startswith("rejected")))
    (out50, in50), (out99, in99) = 1e-6 * np.percentile(latencies, (50, 99), axis=0)
    print(
        f"{'bare' if bare else 'identifier':<12}{'together' if together else 'apart':<10}"
        f"{sent:>8}{lost:>6}{rejected:>10}{len(latencies):>11}"
        f"{out50:>19.2f}{out99:>8.2f}{in50:>17.2f}{in99:>8.2f}{100 * share:>7.1f}"
    )


if __name__ == "__main__":
    main()
