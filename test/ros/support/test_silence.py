"""Why topics are silent. Truth: what the test publishes, and how."""

from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from harness import Probe
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from sysid_node.ros.support.silence import UNHEARD, ClockWatch, joined, several_publishers, why_silent

BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE = QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE)


@pytest.fixture
def node(ros: None) -> Iterator[Node]:
    """A node without topics of its own but ROS's."""
    one = rclpy.create_node("listener", start_parameter_services=False)
    yield one
    one.destroy_node()


def ignored(_: Any) -> None:
    """A message that nothing is made of."""


def test_a_topic_that_nobody_publishes(node: Node) -> None:
    subscription = node.create_subscription(JointState, "lonely/joints", ignored, BEST_EFFORT)
    assert why_silent(node, subscription) == ": nobody publishes it"


def test_topics_of_the_type_elsewhere_are_named(node: Node, probe: Probe) -> None:
    subscription = node.create_subscription(Imu, "mine/imu", ignored, BEST_EFFORT)
    others = [node.create_publisher(Imu, f"drivers/imu{k}", 1) for k in range(3)]
    words = ": nobody publishes it, but sensor_msgs/msg/Imu is published on /drivers/imu0, /drivers/imu1, /drivers/imu2"
    assert len(others) == 3
    probe.until(lambda: why_silent(node, subscription) == f"{words} and 1 more: remap it?")


def test_what_another_aircraft_hears_and_what_nodes_publish_of_their_own_is_not_offered(
    node: Node, probe: Probe
) -> None:
    """Two identifiers fly; the IMU of the second is silent. Remapped to the first's it would learn that aircraft."""
    subscription = node.create_subscription(Imu, "/second/imu", ignored, BEST_EFFORT)
    other = rclpy.create_node(node.get_name(), namespace="/first", start_parameter_services=False)
    published = [other.create_publisher(Imu, name, 1) for name in ("imu", "~/imu", "actuators/excitation", "spare")]
    heard = other.create_subscription(Imu, "imu", ignored, BEST_EFFORT)
    words = ": nobody publishes it, but sensor_msgs/msg/Imu is published on /first/spare, /imu/data: remap it?"
    probe.until(lambda: why_silent(node, subscription) == words)
    assert len(published) == 4
    assert heard is not None
    other.destroy_node()


def test_another_type_is_named(node: Node, probe: Probe) -> None:
    subscription = node.create_subscription(Imu, "typed", ignored, BEST_EFFORT)
    elsewhere = rclpy.Context()  # one participant cannot have two types of a topic
    rclpy.init(context=elsewhere)
    other = rclpy.create_node("talker", context=elsewhere)
    publisher = other.create_publisher(String, "typed", 1)
    words = ": it is published as std_msgs/msg/String, not as sensor_msgs/msg/Imu"
    probe.until(lambda: why_silent(node, subscription) == words)
    other.destroy_publisher(publisher)
    other.destroy_node()
    rclpy.shutdown(context=elsewhere)


@pytest.mark.parametrize(("profile", "known"), [(BEST_EFFORT, True), (RELIABLE, False)])
def test_a_publisher_that_gives_less_than_is_asked_for(
    node: Node, probe: Probe, profile: QoSProfile, known: bool
) -> None:
    subscription = node.create_subscription(Imu, "asked", ignored, RELIABLE)
    publisher = node.create_publisher(Imu, "asked", profile)
    probe.until(lambda: node.count_publishers("asked"))
    assert ("quality of service" in why_silent(node, subscription)) == known
    assert known or why_silent(node, subscription) == ""
    node.destroy_publisher(publisher)


@pytest.mark.parametrize("simulated", [True, False])
def test_a_clock_that_does_not_come(ros: None, probe: Probe, simulated: bool) -> None:
    arguments = ["--ros-args", "-p", f"use_sim_time:={str(simulated).lower()}"]
    one = rclpy.create_node("timed", cli_args=arguments)
    watch = ClockWatch(one)
    assert watch.missing() == {}  # it may still come
    probe.spin(UNHEARD + 0.1)
    assert watch.missing() == ({"/clock": "no message yet, and use_sim_time is true"} if simulated else {})
    one.destroy_node()


def test_a_topic_with_two_publishers_is_said(node: Node, probe: Probe) -> None:
    """Their messages are mixed in order of stamps: estimates had become valid, and nothing had said so."""
    subscriptions = [node.create_subscription(Imu, topic, ignored, BEST_EFFORT) for topic in ("two/imu", "one/imu")]
    publishers = [node.create_publisher(Imu, topic, 1) for topic in ("two/imu", "two/imu", "one/imu")]
    assert len(publishers) == 3
    words = {"/two/imu": "2 publishers, taken as one: stop all but one, or remap their topics"}
    probe.until(lambda: several_publishers(node, subscriptions) == words)


def test_what_is_said_of_one_topic_twice_is_one_line() -> None:
    assert joined({"/a": "late", "/b": "silent"}, {"/a": "doubled", "/c": "doubled"}) == {
        "/a": "late; doubled",
        "/b": "silent",
        "/c": "doubled",
    }
