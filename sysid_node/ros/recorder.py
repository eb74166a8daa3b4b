"""The program `recorder`: records a flight's topics into a bag where `ros2 bag` is not installed; Ctrl-C ends it.

Messages are written byte for byte, with the time at which they arrived.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.utilities import remove_ros_args
from rosbags.rosbag2 import Writer

from sysid_node.flight.bag.writer import STORAGES, add_topic, new_bag
from sysid_node.flight.topics import DERIVATIVES, DERIVATIVES_TYPE, INPUT_TOPICS
from sysid_node.ros.support.spin import run_program, serve, until_shutdown

JOINTS = "sensor_msgs/msg/JointState"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
#: What is recorded: all that is needed to identify again, and the results in flight.
TOPICS: Mapping[str, str] = {
    **INPUT_TOPICS,
    "actuators/command": JOINTS,
    "actuators/excitation": JOINTS,
    "set_points": JOINTS,
    "adaptive_controller/tracking": JOINTS,
    DERIVATIVES.lstrip("/"): DERIVATIVES_TYPE,
    "identifier/model_gap": "sysid_msgs/msg/ModelGap",
    "identifier/correlation": "sysid_msgs/msg/EstimateCorrelation",
    "pose": "geometry_msgs/msg/PoseStamped",
    "fault_monitor/faults": DIAGNOSTICS,
    "/diagnostics": DIAGNOSTICS,
}
#: Best effort, so that no publisher waits for the recorder. The queue is deep enough for a disk that stalls.
QOS = QoSProfile(depth=5000, reliability=ReliabilityPolicy.BEST_EFFORT)


class Recorder(Node):
    """Writes every message of ``topics`` (name -> type) into a bag that is open."""

    def __init__(self, writer: Writer, topics: Mapping[str, str]) -> None:
        super().__init__("recorder")
        self.counts: dict[str, int] = {}  # messages written, by resolved topic
        overrides = QoSOverridingOptions.with_default_policies()
        for topic, type_name in topics.items():
            package, _, name = type_name.partition("/msg/")
            kind = getattr(importlib.import_module(f"{package}.msg"), name)
            resolved = self.resolve_topic_name(topic)
            take = self._writing(writer, resolved, add_topic(writer, resolved, type_name))
            self.create_subscription(kind, topic, take, QOS, raw=True, qos_overriding_options=overrides)

    def words(self) -> str:
        """How much was recorded, and on which topics nothing came."""
        missing = [topic for topic, count in self.counts.items() if not count]
        nothing = f"; nothing came on {', '.join(missing)}" if missing else ""
        return f"recorded {sum(self.counts.values())} messages of {len(self.counts) - len(missing)} topics{nothing}"

    def _writing(self, writer: Writer, topic: str, connection: Any) -> Callable[[bytes], None]:
        self.counts[topic] = 0

        def take(message: bytes) -> None:
            writer.write(connection, time.time_ns(), message)
            self.counts[topic] += 1

        return take


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="recorder", description=__doc__, epilog="ROS arguments follow --ros-args.")
    parser.add_argument("bag", type=Path, help="folder to make")
    parser.add_argument("--storage", choices=list(STORAGES), default="mcap", help="default: mcap")
    return parser


def main() -> None:
    """Entry point of the program."""
    options = _parser().parse_args(remove_ros_args(sys.argv)[1:])

    def record() -> None:
        with new_bag(options.bag, options.storage) as writer:
            recorder = Recorder(writer, TOPICS)
            recorder.get_logger().info(f"records into {options.bag}")
            with until_shutdown():  # the writer aborts on exceptions
                serve(recorder)
        # not the node's own logger, which would try to publish it on /rosout
        get_logger("sysid").info(f"{recorder.words()}, into {options.bag}")

    sys.exit(run_program(record))


if __name__ == "__main__":
    main()
