"""ROS for tests: a node to speak and listen with, programs in processes of their own, a made-up flight."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData, DerivativeEstimates, ModelGap

from sysid_node.flight.streams import AirDataStream, ImuStream, JointStream, Streams, arrivals_in_stamp_order
from sysid_node.ros.support import conversion

ROOT = Path(__file__).resolve().parents[2]
JOINTS = ("elevator", "aileron", "rudder", "throttle")
START_NS = 1_700_000_000_000_000_000
LOSSLESS = [
    f"qos_overrides./{topic}.subscription.{policy}"
    for topic in ("imu/data", "air_data", "actuators")
    for policy in ("reliability:=reliable", "depth:=5000")
]
IMU_SIGNS = np.array([1.0, -1.0, -1.0] * 2)  # FRD to FLU


class Probe:
    """A node that publishes the inputs, hears the outputs and asks for services."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("probe")
        self.estimates: list[Any] = []
        self.gaps: list[Any] = []
        self.diagnostics: dict[str, Any] = {}
        self.clients: dict[str, Any] = {}
        self.imu = self.node.create_publisher(Imu, "imu/data", 100)
        self.air_data = self.node.create_publisher(AirData, "air_data", 100)
        self.actuators = self.node.create_publisher(JointState, "actuators", 100)
        self.node.create_subscription(DerivativeEstimates, "/identifier/derivatives", self.estimates.append, 1000)
        self.node.create_subscription(ModelGap, "/identifier/model_gap", self.gaps.append, 1000)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            self.diagnostics[status.name] = status

    def spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            rclpy.spin_once(self.node, timeout_sec=left)

    def until(self, condition: Callable[[], Any], patience: float = 60.0) -> Any:
        """Spin until the condition holds; its value. Fails, with what /diagnostics said, where it never does."""
        end = time.monotonic() + patience
        while not (found := condition()):
            assert time.monotonic() < end, {name: status.message for name, status in self.diagnostics.items()}
            rclpy.spin_once(self.node, timeout_sec=0.05)
        return found

    def heard(self) -> bool:
        """Whether the identifier listens to all inputs."""
        return all(p.get_subscription_count() for p in (self.imu, self.air_data, self.actuators))

    def await_identifier(self) -> None:
        """Until the identifier listens, and is heard."""
        self.until(lambda: self.heard() and self.node.count_publishers("/identifier/derivatives"))
        self.spin(0.3)

    def play(self, bag: Path, *options: str) -> None:
        """Have the player play a bag four times as fast as recorded, and listen until it is done."""
        with ended(start("player", str(bag), "--rate", "4", "--wait", "20", *options)) as player:
            self.until(lambda: player.poll() is not None, 90.0)

    def speak(self, flight: Streams, start: float = 0.0, stop: float = np.inf, air_data: bool = True) -> None:
        """Publish a flight's messages stamped from ``start`` to ``stop`` s, as fast as they are surely heard."""
        topics = [
            (flight.imu, flight.imu.values * IMU_SIGNS, self.say_imu),
            (
                flight.actuators,
                flight.actuators.positions,
                lambda s, v: self.say_actuators(s, flight.actuators.names, v),
            ),
        ]
        if air_data:
            topics.append((flight.air_data, flight.air_data.values, self.say_air_data))
        messages = []
        for stream, values, say in topics:
            seconds = (stream.arrival.stamp_ns - START_NS) / 1e9
            chosen = (seconds >= start) & (seconds < stop)
            rows = (one[chosen].tolist() for one in (stream.arrival.order, stream.arrival.stamp_ns, values))
            messages += [(order, stamp, say, row) for order, stamp, row in zip(*rows, strict=True)]
        messages.sort(key=lambda message: message[:2])
        for count, (_, stamp, say, row) in enumerate(messages):
            say(stamp, row)
            if count % 20 == 0:
                self.spin(0.01)

    def say_imu(self, stamp: int, values: Sequence[float]) -> None:
        """Specific force and rates, forward-left-up."""
        force, rate = (Vector3(x=float(x), y=float(y), z=float(z)) for x, y, z in (values[:3], values[3:]))
        header = conversion.header(stamp, "base_link")
        self.imu.publish(Imu(header=header, linear_acceleration=force, angular_velocity=rate))

    def say_air_data(self, stamp: int, values: Sequence[float]) -> None:
        """True airspeed, angle of attack, sideslip, air density."""
        names = ("true_airspeed", "angle_of_attack", "sideslip", "air_density")
        header = conversion.header(stamp, "air_data")
        self.air_data.publish(AirData(header=header, **dict(zip(names, values, strict=True))))

    def say_actuators(self, stamp: int, names: Sequence[str], positions: Sequence[float]) -> None:
        """Joint positions."""
        header = conversion.header(stamp, "")
        self.actuators.publish(JointState(header=header, name=list(names), position=list(positions)))

    def ask(self, kind: Any, name: str, request: Any = None) -> Any:
        """A service's answer; what is asked first waits until the server has found who asks, too."""
        client = self.clients.get(name)
        if client is None:
            client = self.clients[name] = self.node.create_client(kind, name)
            assert client.wait_for_service(timeout_sec=60.0), name
            self.spin(0.5)
        future = client.call_async(request or kind.Request())
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=60.0)
        assert future.done(), f"{name} gave no answer"
        return future.result()

    def said(self, part: str, key: str) -> str:
        """The last value of a key on /diagnostics; empty where there is none."""
        status = self.diagnostics.get(f"identifier: {part}")
        return next((pair.value for pair in status.values if pair.key == key), "") if status else ""

    def close(self) -> None:
        self.node.destroy_node()


def start(name: str, *arguments: str) -> subprocess.Popen[str]:
    """A node's program in a process of its own."""
    command = [sys.executable, "-m", f"sysid_node.ros.{name}", *arguments]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


@contextmanager
def ended(process: subprocess.Popen[str], said: list[str] | None = None) -> Iterator[subprocess.Popen[str]]:
    """The process, interrupted at the end, which must be clean; what it wrote is added to ``said``."""
    try:
        yield process
        process.send_signal(signal.SIGINT)
        text, _ = process.communicate(timeout=60.0)
        if said is not None:
            said.append(text)
        assert process.returncode == 0, text
        assert "Traceback" not in text, text
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()


def start_identifier(*parameters: str, lossless: bool = True, namespace: str = "/") -> subprocess.Popen[str]:
    """The identifier with ``name:=value`` parameters; of the cdrw where none of them says otherwise.

    ``lossless``: no message is lost, however busy the machine is; else the quality of service is the default's.
    """
    pairs = ("aircraft:=cdrw", *(LOSSLESS if lossless else ()), *parameters)
    inside = () if namespace == "/" else ("-r", f"__ns:={namespace}")
    return start("identifier", "--ros-args", *inside, *(word for pair in pairs for word in ("-p", pair)))


def identifier(*parameters: str, lossless: bool = True) -> AbstractContextManager[subprocess.Popen[str]]:
    """The same, ended when the block is."""
    return ended(start_identifier(*parameters, lossless=lossless))


def made_up_streams(seconds: float, seed: int = 0) -> Streams:
    """A well excited flight of no aircraft: 200 Hz IMU, 100 Hz air data and actuators; random phases, some noise."""
    rng = np.random.default_rng(seed)

    def wave(t: np.ndarray, middle: float, amplitude: float) -> np.ndarray:
        frequencies = np.arange(0.2, 2.0, 0.1)
        phases = rng.uniform(0.0, 2.0 * np.pi, frequencies.size)
        waves = np.sin(2.0 * np.pi * np.outer(t, frequencies) + phases)
        return middle + amplitude * (waves.mean(axis=1) + 0.01 * rng.normal(size=t.size))

    fast, slow = (START_NS + np.arange(int(seconds * rate)) * (10**9 // rate) for rate in (200, 100))
    imu, air, joints = arrivals_in_stamp_order(fast, slow, slow)
    t, u = (fast - START_NS) / 1e9, (slow - START_NS) / 1e9
    motion = np.column_stack([wave(t, m, 1.0) for m in (0.5, 0.0, -9.8, 0.0, 0.0, 0.0)])
    attitude = np.full((t.size, 3), np.nan)
    angles = ((18.0, 2.0), (0.05, 0.2), (0.0, 0.2), (1.2, 0.0))
    surfaces = ((0.0, 0.3), (0.0, 0.3), (0.0, 0.3), (0.5, 0.1))
    return Streams(
        ImuStream(imu, motion, attitude, "base_link"),
        AirDataStream(air, np.column_stack([wave(u, *pair) for pair in angles])),
        JointStream(joints, JOINTS, np.column_stack([wave(u, *pair) for pair in surfaces])),
        "made up",
    )
