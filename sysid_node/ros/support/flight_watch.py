"""Watches a flight for a viewer: inputs, estimates and faults, taken over in bulk a few times a second."""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData, DerivativeEstimates

from sysid_node.flight.frames import BodyFrame, euler_from_quaternion, turn_vectors
from sysid_node.flight.live.messages import LATEST_SECONDS, TOO_LATE, UNREADABLE
from sysid_node.flight.live.news import FlightNews
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.online.types import Estimates
from sysid_node.ros.support.conversion import NANOSECONDS, estimates_from_message, stamp_ns
from sysid_node.ros.support.loop_node import DERIVATIVES, SENSOR_QOS
from sysid_node.ros.support.spin import take_up

FAULTS = "fault_monitor/faults"

#: Least time between two messages of a topic that are decoded, s: more than the eye sees are left out as they come.
_PERIODS = {IMU: 0.02, AIR_DATA: 0.02, ACTUATORS: 0.02, DERIVATIVES: 0.1, FAULTS: 0.0}
_QUIET = 10.0  # s between two lines in the log about damaged messages


class FlightWatch:
    """``news`` and ``estimates`` since they were last taken; ``faults``: part -> text of what is reported now.

    Subscriptions are best effort, so that no publisher waits for them, and messages that are left out are not decoded.
    """

    def __init__(self, frame: BodyFrame = "flu", name: str = "view") -> None:
        self.start_ns = 0  # the first stamp
        self.faults: Mapping[str, str] = {}
        self.frame: BodyFrame = frame  # of the IMU's messages
        self._news = FlightNews([], [], [])
        self._estimates: list[Estimates] = []
        self.node: Node = rclpy.create_node(name)
        for kind, topic, take in (
            (Imu, IMU, self._on_imu),
            (AirData, AIR_DATA, self._on_air_data),
            (JointState, ACTUATORS, self._on_actuators),
            (DerivativeEstimates, DERIVATIVES, self._on_estimates),
            (DiagnosticArray, FAULTS, self._on_faults),
        ):
            self.node.create_subscription(kind, topic, self._sparsely(kind, topic, take), SENSOR_QOS, raw=True)
        self._executor = EventsExecutor()
        take_up(self._executor, self.node)

    def listen(self, seconds: float) -> None:
        """Receive messages for so many seconds of a clock that never jumps, whatever the time of /clock."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0 and rclpy.ok():
            self._executor.spin_once(timeout_sec=left)

    def take(self) -> tuple[FlightNews, list[Estimates]]:
        """What came in since the last call; times of estimates are in s from ``start_ns``."""
        taken = self._news, self._estimates
        self._news, self._estimates = FlightNews([], [], []), []
        return taken

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self.node.destroy_node()

    def _sparsely(self, kind: Any, topic: str, take: Callable[[Any], None]) -> Callable[[bytes], None]:
        """A callback that decodes serialised messages, and leaves out those that follow too soon by their stamps.

        Those that are damaged or stamped too late are left out, too, and the log says so.
        """
        period, due = round(NANOSECONDS * _PERIODS[topic]), 0

        def on_message(raw: bytes) -> None:
            nonlocal due
            try:
                seconds, nanoseconds = struct.unpack_from("<iI" if raw[1] & 1 else ">iI", raw, 4)  # after CDR's header
                stamp = seconds * NANOSECONDS + nanoseconds
                if 0 < due - stamp <= period:
                    return
                message = deserialize_message(raw, kind)
                reason = TOO_LATE if seconds >= LATEST_SECONDS else ""
            except (struct.error, IndexError, rclpy_implementation.RMWError):
                reason = UNREADABLE
            if reason:
                name = self.node.resolve_topic_name(topic)
                self.node.get_logger().warning(f"{name}: a message is {reason}", throttle_duration_sec=_QUIET)
            else:
                due = stamp + period
                take(message)

        return on_message

    def _on_imu(self, message: Any) -> None:
        pair = (message.linear_acceleration, message.angular_velocity)
        vectors = np.array([[vector.x, vector.y, vector.z] for vector in pair])
        values = turn_vectors(vectors, self.frame).ravel().tolist()
        self._news.imu.append((self._stamp(message), (*values, *self._attitude(message))))

    def _attitude(self, message: Any) -> list[float]:
        if message.orientation_covariance[0] == -1.0:
            return [math.nan] * 3
        quaternion = np.array([[getattr(message.orientation, part) for part in "xyzw"]])
        angles: list[float] = euler_from_quaternion(quaternion, self.frame)[0].tolist()
        return angles

    def _on_air_data(self, message: Any) -> None:
        values = (message.true_airspeed, message.angle_of_attack, message.sideslip, message.air_density)
        self._news.air.append((self._stamp(message), values))

    def _on_actuators(self, message: Any) -> None:
        joints = dict(zip(message.name, message.position, strict=False))
        self._news.joints.append((self._stamp(message), joints))

    def _on_estimates(self, message: Any) -> None:
        self._stamp(message)
        self._estimates.append(estimates_from_message(message, self.start_ns))

    def _on_faults(self, message: Any) -> None:
        self.faults = {status.name.partition(": ")[2]: status.message for status in message.status}

    def _stamp(self, message: Any) -> int:
        stamp = stamp_ns(message.header.stamp)
        self.start_ns = self.start_ns or stamp
        return stamp
