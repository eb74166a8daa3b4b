"""Watches a closed loop: tracking errors, diagnostics and estimates; sends set-points, effects and requests."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from sysid_msgs.msg import DerivativeEstimates

from sysid_node.online.types import Estimates
from sysid_node.ros.support.conversion import NANOSECONDS, estimates_from_message, stamp_ns
from sysid_node.ros.support.loop_node import DERIVATIVES, SET_POINTS, named

TRACKING = "adaptive_controller/tracking"
CONTROLLER, MONITOR = "adaptive_controller", "fault_monitor"
TROUBLES = ": troubles so far"
RUNNING = re.compile(r" for [\d.]+ s")  # the duration of a silence, which changes all the time
PATIENCE = 20.0  # s to wait for a service


class LoopWatch:
    """``tracking``: (time in s of the flight, errors by name); ``estimates``: the newest; ``words``: by node.

    It may share an ``executor`` with other nodes. At 200 messages a second only the events executor keeps up on a busy
    machine: with others, messages wait in queues and are taken as present when they are old.
    """

    def __init__(self, executor: Any = None) -> None:
        self.tracking: list[tuple[float, dict[str, float]]] = []
        self.estimates: Estimates | None = None
        self.words: dict[str, DiagnosticStatus] = {}
        self.start_ns = 0
        self._node: Node = rclpy.create_node("loop_watch")
        self._points = self._node.create_publisher(JointState, SET_POINTS, 10)
        self._node.create_subscription(JointState, TRACKING, self._on_tracking, 1000)
        self._node.create_subscription(DerivativeEstimates, DERIVATIVES, self._on_estimates, 100)
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)
        self._executor = executor or EventsExecutor()
        self._executor.add_node(self._node)

    @property
    def time(self) -> float:
        """Seconds of the flight so far."""
        return self.tracking[-1][0] if self.tracking else 0.0

    def listen(self, seconds: float) -> None:
        """Receive messages for so many seconds."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def ask_for(self, points: Mapping[str, float]) -> None:
        """Send set-points by name, rad and m/s."""
        self._points.publish(named(time.time_ns(), points))

    def set_effects(self, effects: str) -> str:
        """Set the simulated aircraft's effects; returns why they are refused, empty where they are not."""
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=effects)
        request = SetParameters.Request(parameters=[Parameter(name="effects", value=value)])
        answer = self.call(SetParameters, "flight_simulator/set_parameters", request)
        return str(answer.results[0].reason)

    def excite(self) -> str:
        """Begin the excitation; returns why the exciter refuses, empty where it does not."""
        answer = self.call(Trigger, "exciter/start", Trigger.Request())
        return "" if answer.success else str(answer.message)

    def said(self, node: str) -> str:
        """The last message of a node on /diagnostics."""
        return str(self.words[node].message) if node in self.words else ""

    def value(self, node: str, key: str) -> str:
        """The last value of a key of a node on /diagnostics; empty where there is none."""
        pairs = self.words[node].values if node in self.words else ()
        return next((str(pair.value) for pair in pairs if pair.key == key), "")

    def news(self) -> dict[str, str]:
        """By node, gains, excitation and faults in words, without the numbers that change all the time.

        What the fault monitor says of topics on which it hears nothing, by their resolved names, is no fault.
        """
        gains = "; ".join(f"{axis}: {self.value(CONTROLLER, f'{axis}: gains')}" for axis in ("pitch", "lateral"))
        known = CONTROLLER in self.words
        said = [part for part in self.said(MONITOR).split("; ") if not part.startswith("/")]
        faults = "; ".join(fault.partition(",")[0] for fault in said)
        return {
            CONTROLLER: RUNNING.sub("", gains) if known else "",
            "exciter": self.value("exciter", "last event"),
            MONITOR: faults,
        }

    def troubles(self) -> dict[str, int]:
        """By topic, the number of problems that the controller has counted."""
        pairs = self.words[CONTROLLER].values if CONTROLLER in self.words else ()
        counts = {pair.key.partition(": ")[0]: int(pair.value) for pair in pairs if pair.key.endswith(TROUBLES)}
        return {topic: count for topic, count in counts.items() if count}

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self._node.destroy_node()

    def call(self, kind: Any, name: str, request: Any) -> Any:
        """The answer of the service ``name`` of type ``kind``. Raises RuntimeError where none comes in time."""
        client = self._node.create_client(kind, name)
        try:
            end = time.monotonic() + PATIENCE
            while not client.service_is_ready() and time.monotonic() < end:
                self.listen(0.05)
            future = client.call_async(request)
            while not future.done() and time.monotonic() < end:
                self.listen(0.02)
            if not future.done():
                raise RuntimeError(f"{name} gave no answer within {PATIENCE:g} s")
            return future.result()
        finally:
            self._node.destroy_client(client)

    def _on_tracking(self, message: Any) -> None:
        stamp = stamp_ns(message.header.stamp)
        self.start_ns = self.start_ns or stamp
        row = dict(zip(message.name, message.position, strict=True))
        self.tracking.append(((stamp - self.start_ns) / NANOSECONDS, row))

    def _on_estimates(self, message: Any) -> None:
        self.estimates = estimates_from_message(message, self.start_ns)

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            node, _, part = status.name.partition(": ")
            if part == ("estimate" if node == "identifier" else "state"):
                self.words[node] = status
