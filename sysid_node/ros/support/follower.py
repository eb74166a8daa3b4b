"""Follows an identifier: collects its estimates over time, and its diagnostics."""

from __future__ import annotations

import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sysid_msgs.msg import DerivativeEstimates

from sysid_node.online.types import Estimates
from sysid_node.ros.support.conversion import estimates_from_message


class Follower:
    """The history of ``/identifier/derivatives`` (times in s from ``start_ns``), and the last diagnostics by part."""

    def __init__(self, start_ns: int) -> None:
        self.history: list[Estimates] = []
        self.words: dict[str, DiagnosticStatus] = {}  # by part: "input", "estimate", ...
        self._start_ns = start_ns
        self._node: Node = rclpy.create_node("follower")
        self._node.create_subscription(DerivativeEstimates, "/identifier/derivatives", self._on_estimates, 1000)
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)

    def listen(self, seconds: float) -> None:
        """Receive messages for so many seconds."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def word(self, part: str, key: str) -> str:
        """The last value of a key of /diagnostics; empty where there is none."""
        values = self.words[part].values if part in self.words else ()
        return next((str(pair.value) for pair in values if pair.key == key), "")

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self._node.destroy_node()

    def _on_estimates(self, message: DerivativeEstimates) -> None:
        estimates = estimates_from_message(message, self._start_ns)
        if not self.history or estimates.time > self.history[-1].time:
            self.history.append(estimates)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            node, _, part = status.name.partition(": ")
            if node == "identifier":
                self.words[part] = status
