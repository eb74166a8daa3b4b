"""The fault monitor over DDS: in the loop with the simulator, from the forces and from the servos' positions."""

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from harness import JOINTS, Probe, ended, start
from rcl_interfaces.msg import Log
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import LoggingSeverity

from sysid_node.ros.support.loop_watch import LoopWatch

TIMES = ("onset", "found", "now")
LAG = "actuator_lag:time_constant=0.05"


class Listener:
    """What `fault_monitor/faults` said last, by part; and what its log said as warnings."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("fault_listener")
        self.faults: dict[str, dict[str, str]] = {}
        self.warnings: list[str] = []
        self.node.create_subscription(DiagnosticArray, "/fault_monitor/faults", self.take, 10)
        self.node.create_subscription(Log, "/rosout", self.take_log, 100)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)

    def take(self, message: Any) -> None:
        self.faults = {
            status.name.partition(": ")[2]: {pair.key: pair.value for pair in status.values}
            for status in message.status
        }

    def take_log(self, message: Any) -> None:
        if message.name == "fault_monitor" and message.level == LoggingSeverity.WARN:
            self.warnings.append(message.msg)

    def close(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def heard(ros: None) -> Iterator[tuple[LoopWatch, Listener]]:
    watch, listener = LoopWatch(), Listener()
    yield watch, listener
    watch.close()
    listener.close()


def until(watch: LoopWatch, listener: Listener, condition: Callable[[], bool], patience: float = 120.0) -> None:
    """Listen until the condition holds, asking for roll and pitch all the while."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, (listener.faults, watch.words)
        phase = int(watch.time / 1.5) % 4
        watch.ask_for({"roll": (0.3, 0.0, -0.3, 0.0)[phase], "pitch": (0.13, 0.08, 0.04, 0.08)[phase]})
        watch.listen(0.1)
        listener.executor.spin_once(timeout_sec=0.02)


@pytest.mark.slow
def test_what_fails_in_the_loop_is_said(heard: tuple[LoopWatch, Listener]) -> None:
    """A jammed servo shows in its position; a lost effect only in the forces; a dead sensor in its silence."""
    watch, listener = heard
    own = {"fault_monitor": ("learning:=10.0",)}
    with contextlib.ExitStack() as stack:
        nodes = {}
        for name in ("flight_simulator", "adaptive_controller", "fault_monitor"):
            words = [word for pair in ("aircraft:=cdrw", *own.get(name, ())) for word in ("-p", pair)]
            nodes[name] = stack.enter_context(ended(start(name, "--ros-args", *words)))
        until(watch, listener, lambda: watch.said("fault_monitor") == "nothing has failed")
        assert watch.set_effects(f"{LAG} control_effectiveness_loss:aileron=0.7") == ""
        until(watch, listener, lambda: listener.faults.get("aileron", {}).get("kind") == "loss of effectiveness")
        assert float(listener.faults["aileron"]["size"]) == pytest.approx(0.7, abs=0.2)
        times = [float(listener.faults["aileron"][f"{name} (s since the first IMU message)"]) for name in TIMES]
        assert times == sorted(times)
        until(watch, listener, lambda: any("aileron" in line for line in listener.warnings))
        assert watch.set_effects(f"{LAG} stuck_surface:rudder=1:rudder_position=0.1") == ""
        until(watch, listener, lambda: listener.faults.get("rudder", {}).get("kind") == "stuck surface")
        assert float(listener.faults["rudder"]["size"]) == pytest.approx(0.1, abs=0.01)
        nodes["flight_simulator"].kill()
        until(watch, listener, lambda: listener.faults.get("imu/data", {}).get("kind") == "sensor silent")
        nodes["flight_simulator"].wait()
        nodes["flight_simulator"].returncode = 0


@pytest.mark.slow
def test_messages_that_are_rejected_are_no_sound_flight(probe: Probe) -> None:
    """It had said that nothing has failed, or that it learns, while each message of the IMU was left out."""
    said: list[str] = []
    words = ("nothing is judged: no complete sample comes", "/imu/data: all of", "most as not finite")
    with ended(start("fault_monitor", "--ros-args", "-p", "aircraft:=cdrw"), said):
        probe.until(probe.heard)

        def told() -> bool:
            stamp = time.time_ns()
            probe.say_imu(stamp, (math.nan,) * 6)
            probe.say_air_data(stamp, (18.0, 0.05, 0.0, 1.2))
            probe.say_actuators(stamp, JOINTS, (0.0, 0.0, 0.0, 0.5))
            status = probe.diagnostics.get("fault_monitor: state")
            return status is not None and status.level == DiagnosticStatus.WARN and words[0] in status.message

        probe.until(told)
        assert all(word in probe.diagnostics["fault_monitor: state"].message for word in words)
    assert all(word in said[0] for word in words)
