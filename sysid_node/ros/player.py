"""The program `player`: publishes a bag's messages at the pace at which they were recorded."""

from __future__ import annotations

import argparse
import importlib
import struct
import sys
import time
from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.utilities import remove_ros_args
from rosbags.rosbag2 import Reader
from rosgraph_msgs.msg import Clock

from sysid_node.errors import InputError
from sysid_node.flight.bag.reader import open_bag, reading
from sysid_node.flight.commands import COMMANDS, POSITIONS
from sysid_node.ros.support.conversion import NANOSECONDS, stamp_message
from sysid_node.ros.support.spin import run_program

CLOCK_PERIOD = NANOSECONDS // 100
ACKNOWLEDGED = Duration(seconds=5)  # the longest wait for subscribers to acknowledge the last messages
#: Recorded beside the topic ``actuators``, to which alone an identifier listens: nobody waits for listeners of these.
BESIDE = (COMMANDS, POSITIONS)
KEPT = 5000  # messages of a topic that are kept for a subscriber that is behind
SETTLE = 0.3  # s after a subscriber is found, until it receives messages for certain


class Player(Node):
    """Publishes a bag's topics under their own names (which ROS remaps as for any node), reliably."""

    def __init__(self, topics: dict[str, str], clock: bool) -> None:
        """``topics``: name -> type, e.g. ``sensor_msgs/msg/Imu``; an unknown type is left out, with a warning."""
        super().__init__("player")
        self._topics: dict[str, tuple[Any, bool]] = {}  # publisher, whether its messages begin with a header
        for name, type_name in topics.items():
            kind = _message_class(type_name)
            if kind is None:
                self.get_logger().warning(f"{name} is not played: its type {type_name} is not installed here")
                continue
            publisher = self.create_publisher(kind, name, QoSProfile(depth=KEPT))
            first = next(iter(kind.get_fields_and_field_types().values()), "")
            self._topics[name] = publisher, first == "std_msgs/Header"
        self._clock = self.create_publisher(Clock, "/clock", 10) if clock else None

    def await_listeners(self, patience: float, topics: Sequence[str] = ()) -> None:
        """Wait up to ``patience`` s until each of the ``topics`` has a subscriber; log those without one.

        Without any: every topic but those ``BESIDE``.
        """
        end = time.monotonic() + patience
        unheard = self._unheard(topics)
        while unheard and time.monotonic() < end and rclpy.ok():
            time.sleep(0.02)
            unheard = self._unheard(topics)
        if unheard:
            self.get_logger().warning(f"nobody listens to {', '.join(unheard)}")
        else:
            time.sleep(SETTLE)

    def play(self, messages: Iterable[tuple[str, int, bytes]], rate: float, restamp: bool) -> int:
        """Publish (topic, log time in ns, serialised message), ``rate`` times as fast as recorded. Returns how many.

        With ``restamp`` all stamps, and /clock, are moved by one constant that takes the first log time to now.
        """
        begun, first, shift, next_clock, count = 0, None, 0, 0, 0
        for topic, log_ns, raw in messages:
            if first is None:
                begun, first = time.monotonic_ns(), log_ns
                shift = time.time_ns() - log_ns if restamp else 0
            if not _sleep_until(begun + int((log_ns - first) / rate)):
                break
            if self._clock is not None and log_ns >= next_clock:
                self._clock.publish(Clock(clock=stamp_message(log_ns + shift)))
                next_clock = log_ns + CLOCK_PERIOD
            if topic in self._topics:
                publisher, headed = self._topics[topic]
                publisher.publish(shift_stamp(raw, shift) if headed and shift else raw)
                count += 1
        if rclpy.ok():  # messages that are not delivered yet would be lost with this process
            for publisher, _ in self._topics.values():
                publisher.wait_for_all_acked(ACKNOWLEDGED)
        return count

    def _unheard(self, topics: Sequence[str]) -> list[str]:
        waited = topics or [name for name in self._topics if name not in BESIDE]
        publishers = ((name, publisher) for name, (publisher, _) in self._topics.items() if name in waited)
        return [name for name, publisher in publishers if not publisher.get_subscription_count()]


def shift_stamp(raw: bytes, shift: int) -> bytes:
    """A serialised message that begins with a header, its stamp moved by ``shift`` ns (CDR: sec, nanosec at byte 4)."""
    form = "<iI" if raw[1] & 1 else ">iI"
    seconds, nanoseconds = struct.unpack_from(form, raw, 4)
    moved = divmod(seconds * NANOSECONDS + nanoseconds + shift, NANOSECONDS)
    return raw[:4] + struct.pack(form, *moved) + raw[12:]


def recorded(bag: Reader, path: Path) -> Iterator[tuple[str, int, bytes]]:
    """(topic, log time in ns, serialised message) of a bag at ``path``. Raises InputError where it is damaged."""
    with reading(path):
        for connection, log_ns, raw in bag.messages():
            yield connection.topic, log_ns, raw


def _refuse_unknown(topics: Sequence[str], known: Collection[str], path: Path) -> None:
    """Raise InputError where a topic is not in the bag: nobody would be waited for."""
    unknown = [topic for topic in topics if topic not in known]
    if unknown:
        raise InputError(f"--wait-for {unknown[0]}: not in {path}, which holds {', '.join(sorted(known))}")


def _message_class(type_name: str) -> Any:
    """The class of ``package/msg/Name``, None where its package is not installed."""
    package, _, name = type_name.partition("/msg/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), name, None)
    except ImportError:
        return None


def _sleep_until(moment: int) -> bool:
    """Sleep until a monotonic time in ns. False where ROS was shut down meanwhile."""
    while rclpy.ok():
        left = (moment - time.monotonic_ns()) / NANOSECONDS
        if left <= 0.0:
            return True
        time.sleep(min(left, 0.1))
    return False


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text}: expected a number over zero")
    return value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="player", description=__doc__, epilog="ROS arguments follow --ros-args.")
    parser.add_argument("bag", type=Path, help="rosbag2 folder, or .mcap or .db3 file")
    parser.add_argument("--rate", type=_positive, default=1.0, help="how many times as fast as recorded (1)")
    parser.add_argument("--restamp", action="store_true", help="move all stamps by one constant, to now")
    parser.add_argument("--clock", action="store_true", help="publish /clock, for nodes with use_sim_time")
    parser.add_argument("--wait", type=float, default=5.0, help="longest wait for listeners, s (5)")
    parser.add_argument(
        "--wait-for", metavar="TOPIC", nargs="+", default=[], help="wait for listeners of these topics alone"
    )
    return parser


def main() -> None:
    """Entry point of the program."""
    options = _parser().parse_args(remove_ros_args(sys.argv)[1:])

    def play() -> None:
        with open_bag(options.bag) as bag:
            recorded_types = {connection.topic: connection.msgtype for connection in bag.connections}
            _refuse_unknown(options.wait_for, recorded_types, options.bag)
            player = Player(recorded_types, options.clock)
            player.await_listeners(options.wait, options.wait_for)
            count = player.play(recorded(bag, options.bag), options.rate, options.restamp)
            player.get_logger().info(f"played {count} messages of {options.bag}")

    sys.exit(run_program(play))


if __name__ == "__main__":
    main()
