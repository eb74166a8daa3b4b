"""The closed loop over DDS: nodes in processes of their own, killed, restarted, starved of messages. It flies on."""

import contextlib
import random
import subprocess
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
import rclpy
from harness import start
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData

from sysid_node.ros.support.loop_node import COMMAND, LATEST, named
from sysid_node.ros.support.loop_watch import LoopWatch

SIMULATOR, CONTROLLER, IDENTIFIER, EXCITER = "flight_simulator", "adaptive_controller", "identifier", "exciter"
OWN = {IDENTIFIER: ("method:=sls_rft",), EXCITER: ("accuracy:=0.3",)}
LOST = 0.6  # rad of tracking error: control is as good as lost
TRACKS = 0.1  # rad


def begin(name: str, *remaps: str) -> subprocess.Popen[str]:
    """A node of the loop."""
    words = [word for pair in ("aircraft:=cdrw", *OWN.get(name, ())) for word in ("-p", pair)]
    return start(name, "--ros-args", *words, *(word for pair in remaps for word in ("-r", pair)))


def kill(process: subprocess.Popen[str]) -> None:
    """As a crash would."""
    process.kill()
    process.communicate()


@contextlib.contextmanager
def flying(**processes: subprocess.Popen[str]) -> Iterator[dict[str, subprocess.Popen[str]]]:
    """Nodes under way, which may be replaced; ended at the end.

    They are asked to end, so that each closes what it has open.
    """
    try:
        yield processes
    finally:
        for process in processes.values():
            process.terminate()
        for process in processes.values():
            try:
                process.communicate(timeout=60.0)
            except subprocess.TimeoutExpired:
                kill(process)


@pytest.fixture
def watch(ros: None) -> Iterator[LoopWatch]:
    one = LoopWatch()
    yield one
    one.close()


def until(watch: LoopWatch, condition: Callable[[], bool], what: str, patience: float = 120.0) -> None:
    """Listen until the condition holds, asking for roll and pitch all the while."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, f"{what}: {watch.words}"
        watch.ask_for({"roll": 0.2 * (int(watch.time / 3.0) % 2), "pitch": 0.1})
        watch.listen(0.1)


def worst(watch: LoopWatch, since: int) -> float:
    """The largest error of pitch or roll from a row of the tracking on, rad."""
    rows = [[row["pitch error"], row["roll error"]] for _, row in watch.tracking[since:]]
    return float(np.nanmax(np.abs(rows)))  # NaN: no IMU at that time


def excited(watch: LoopWatch) -> bool:
    """Whether excitation has shown enough; it is asked for, and again where a busy machine's silence ended it."""
    last = watch.value(EXCITER, "last event")
    if not last.startswith(("begun", "known")) and watch.value(EXCITER, "active") == "False":
        watch.excite()
        watch.listen(1.2)
    return last.startswith("known")


def tracks(watch: LoopWatch, rows: int = 200) -> bool:
    """Whether the last so many rows are there and close to what is asked for."""
    errors = [[row["pitch error"], row["roll error"]] for _, row in watch.tracking[-rows:]]
    return len(errors) == rows and float(np.nanmax(np.abs(errors))) < TRACKS


@pytest.mark.slow
def test_nodes_die_and_come_back_and_the_aircraft_flies_on(watch: LoopWatch) -> None:
    nodes = {name: begin(name) for name in (SIMULATOR, IDENTIFIER, EXCITER, CONTROLLER)}
    with flying(**nodes) as loop:
        until(watch, lambda: tracks(watch), "never flew")
        until(watch, lambda: excited(watch), "never known")
        until(watch, lambda: "adapted" in watch.value(CONTROLLER, "pitch: gains"), "never adapted")
        since = len(watch.tracking)

        kill(loop[IDENTIFIER])
        until(watch, lambda: "no estimates for" in watch.said(CONTROLLER), "did not notice the identifier's death")
        loop[IDENTIFIER] = begin(IDENTIFIER)
        until(watch, lambda: "no estimates" not in watch.said(CONTROLLER), "did not hear it again")

        watch.excite()
        watch.listen(1.0)
        kill(loop[EXCITER])
        until(watch, lambda: tracks(watch, 50), "lost without the exciter")
        assert worst(watch, since) < LOST

        kill(loop[CONTROLLER])
        flown = len(watch.tracking)
        loop[CONTROLLER] = begin(CONTROLLER)
        until(watch, lambda: len(watch.tracking) > flown + 200, "the controller did not come back")
        until(watch, lambda: tracks(watch), "never tracked again")
        assert watch.value(SIMULATOR, "commands refused") == "0"


class Relay:
    """Passes messages of the simulator on, but for some."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("relay")
        self.drop, self.silent, self.random = 0.0, "", random.Random(1)
        for kind, topic in ((Imu, "imu/data"), (AirData, "air_data"), (JointState, "actuators")):
            to = self.node.create_publisher(kind, topic, 50)
            self.node.create_subscription(kind, f"raw/{topic}", self.passing(topic, to.publish), LATEST)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)

    def passing(self, topic: str, on: Callable[[object], None]) -> Callable[[object], None]:
        def take(message: object) -> None:
            if topic != self.silent and self.random.random() >= self.drop:
                on(message)

        return take

    def run(self, watch: LoopWatch, seconds: float) -> None:
        """Relay, and hear, for so long."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.002)
            watch.listen(0.0005)
        watch.ask_for({"roll": 0.2, "pitch": 0.1})

    def until(self, watch: LoopWatch, condition: Callable[[], bool], patience: float = 120.0) -> None:
        """Relay until the condition holds."""
        end = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < end, watch.words
            self.run(watch, 0.2)

    def close(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()


@pytest.mark.slow
def test_lost_messages_and_a_silent_sensor(watch: LoopWatch) -> None:
    remaps = [f"{topic}:=raw/{topic}" for topic in ("imu/data", "air_data", "actuators")]
    relay = Relay()
    with flying(simulator=begin(SIMULATOR, *remaps), controller=begin(CONTROLLER)):
        relay.until(watch, lambda: tracks(watch))
        relay.drop = 0.3
        since = len(watch.tracking)
        relay.until(watch, lambda: len(watch.tracking) > since + 200)
        assert worst(watch, since) < LOST
        relay.drop, relay.silent = 0.0, "air_data"
        relay.until(watch, lambda: "not measured" in watch.said(CONTROLLER))
        relay.run(watch, 1.0)
        assert worst(watch, since) < LOST
        relay.silent = "imu/data"
        relay.until(watch, lambda: "imu/data silent" in watch.said(CONTROLLER))
        relay.silent = ""
        relay.until(watch, lambda: "silent" not in watch.said(CONTROLLER) and tracks(watch))
    relay.close()


@pytest.mark.slow
def test_the_simulator_flies_and_refuses_nonsense(watch: LoopWatch) -> None:
    heard: list[Imu] = []
    node = rclpy.create_node("listener")
    node.create_subscription(Imu, "imu/data", heard.append, LATEST)
    command = node.create_publisher(JointState, COMMAND, 10)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with flying(simulator=begin(SIMULATOR)):
        end = time.monotonic() + 60.0
        while len(heard) < 100 and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.1)
        stamps = np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in heard])
        assert np.median(np.diff(stamps)) == pytest.approx(0.005, rel=1e-3)
        assert "not known" in watch.set_effects("wings_off:left=1")
        assert watch.set_effects("control_effectiveness_loss:elevator=0.6") == ""
        command.publish(named(0, {"elevator": float("nan"), "aileron": 0.0, "rudder": 0.0, "throttle": 0.5}))
        command.publish(named(0, {"elevator": 0.0}))
        until(watch, lambda: watch.value(SIMULATOR, "commands refused") == "2", "took nonsense")
    executor.shutdown()
    node.destroy_node()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "parameter", "words"),
    [
        (SIMULATOR, "effects:=wings_off", "wings_off"),
        (CONTROLLER, "gain_margin:=0.1", "gain_margin"),
    ],
)
def test_wrong_parameters_end_the_node_with_one_line(ros: None, name: str, parameter: str, words: str) -> None:
    process = start(name, "--ros-args", "-p", "aircraft:=cdrw", "-p", parameter)
    text, _ = process.communicate(timeout=120.0)
    assert process.returncode == 2
    assert words in text
    assert "Traceback" not in text
