"""The player: a bag's messages, unchanged, in order, at its pace."""

import itertools
import struct
import time
from pathlib import Path

import pytest
from harness import ROOT, START_NS, Probe, ended, start
from hypothesis import given
from hypothesis import strategies as st
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu

from sysid_node.flight.bag.reader import read_streams
from sysid_node.ros.player import shift_stamp
from sysid_node.ros.support import conversion


@given(st.integers(0, 2**31 * 10**9 // 2), st.integers(-(10**18), 10**18))
def test_a_shifted_stamp_moves_and_nothing_else_does(stamp: int, shift: int) -> None:
    if not 0 <= stamp + shift < 2**31 * 10**9:
        return
    message = Imu(header=conversion.header(stamp, "base_link"))
    message.angular_velocity.x = 0.1
    moved = deserialize_message(shift_stamp(serialize_message(message), shift), Imu)
    assert conversion.stamp_ns(moved.header.stamp) == stamp + shift
    moved.header.stamp = message.header.stamp
    assert moved == message


def test_a_big_endian_stamp_moves_too() -> None:
    raw = b"\x00\x00\x00\x00" + struct.pack(">iI", 5, 999_999_999) + b"rest"
    assert shift_stamp(raw, 2) == b"\x00\x00\x00\x00" + struct.pack(">iI", 6, 1) + b"rest"


def hear(probe: Probe, bag: Path, *options: str) -> tuple[list[Imu], list[Clock]]:
    """What is heard of a bag while it is played."""
    imu: list[Imu] = []
    clock: list[Clock] = []
    mine = [
        probe.node.create_subscription(Imu, "imu/data", imu.append, QoSProfile(depth=5000)),
        probe.node.create_subscription(Clock, "/clock", clock.append, QoSProfile(depth=5000)),
    ]
    with ended(start("player", str(bag), *options)) as player:
        probe.until(lambda: player.poll() is not None, 120.0)
    # what is still on its way: a busy machine delivers late
    count, quiet = -1, time.monotonic() + 10.0
    while count != len(imu) + len(clock) and time.monotonic() < quiet:
        count = len(imu) + len(clock)
        probe.spin(0.5)
    for subscription in mine:
        probe.node.destroy_subscription(subscription)
    return imu, clock


@pytest.mark.slow
def test_a_bag_is_heard_whole_in_order_with_its_own_stamps(probe: Probe, bag: Path) -> None:
    """Nobody listens to the other topics: it plays all the same after ``--wait``, in which all others are found."""
    imu, clock = hear(probe, bag, "--rate", "8", "--wait", "2", "--clock")
    stream = read_streams(bag).imu
    heard = [conversion.stamp_ns(message.header.stamp) for message in imu]
    assert heard == stream.arrival.stamp_ns.tolist()
    assert imu[0].angular_velocity.y == -stream.values[0, 4]
    times = [conversion.stamp_ns(message.clock) for message in clock]
    assert all(later - earlier >= 10_000_000 for earlier, later in itertools.pairwise(times))
    assert times[0] == START_NS
    assert len(times) > 1000


@pytest.mark.slow
def test_restamped_all_stamps_move_by_one_constant_to_now(probe: Probe, bag: Path) -> None:
    """The topics to which nobody listens are not waited for."""
    imu, _ = hear(probe, bag, "--rate", "8", "--wait", "200", "--wait-for", "/imu/data", "--restamp")
    now = probe.node.get_clock().now().nanoseconds
    stamps = read_streams(bag).imu.arrival.stamp_ns.tolist()
    heard = [conversion.stamp_ns(message.header.stamp) for message in imu]
    shift = heard[-1] - stamps[-1]
    assert [stamp - shift for stamp in heard] == stamps
    assert abs(START_NS + shift - now) < 60 * 10**9


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere"], "bag nowhere: does not exist in "),
        (["--rate", "0", "nowhere"], "expected a number over zero"),
        (["--rate", "fast", "nowhere"], "argument --rate: fast: expected a number over zero"),
        ([str(ROOT / "bags" / "cdrw_random"), "--wait-for", "/imu"], "--wait-for /imu: not in "),
    ],
)
def test_bad_input_is_one_line_and_code_2(ros: None, arguments: list[str], words: str) -> None:
    process = start("player", *arguments)
    text, _ = process.communicate(timeout=60.0)
    assert process.returncode == 2
    assert words in text
    assert "Traceback" not in text
