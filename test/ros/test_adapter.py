"""The node, over DDS where messages are ROS's own; the autopilots' packages need not be installed."""

import math
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from importlib.util import find_spec
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rclpy
import yaml
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Vector3
from harness import ROOT, Probe
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from sensor_msgs.msg import FluidPressure, Imu, JointState
from std_msgs.msg import Header
from sysid_msgs.msg import AirData

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.attitude import Attitude
from sysid_node.flight.autopilots.base import AdapterSettings, AirSample, ImuSample, JointSample, Sample, header_ns
from sysid_node.flight.autopilots.mavros import IMU, PRESSURE, Mavros
from sysid_node.flight.autopilots.px4 import Px4
from sysid_node.flight.frames import euler_from_quaternion, quaternion_from_euler
from sysid_node.ros.adapter import PARAMETERS, AdapterNode, imu_message, message_class, parameter_file
from sysid_node.ros.support import conversion

STAMP = 1_700_000_000_250_000_000
JOINTS = "elevator=out1:0:1"


class Standard(Mavros):
    """Those of MAVROS's topics whose types are ROS's own; for air data and joints, another of them."""

    topics = MappingProxyType({IMU: "sensor_msgs/msg/Imu", PRESSURE: "sensor_msgs/msg/FluidPressure"})

    def hear(self, topic: str, message: Any) -> Sample | None:
        if topic == PRESSURE and message.variance:
            return self.deflections(header_ns(message), {"out1": message.variance})
        if topic == PRESSURE:
            return self.air(header_ns(message), 20.0, self.density(message.fluid_pressure))
        return super().hear(topic, message)


class Deaf(Standard):
    """Its topic is the adapter's own."""

    topics = MappingProxyType({"/imu/data": "sensor_msgs/msg/Imu"})


def adapter(kind: type, **values: object) -> AdapterNode:
    overrides = [
        Parameter(name, value=value) for name, value in {"autopilot": "mine", "joints": JOINTS, **values}.items()
    ]
    return AdapterNode({"mine": kind}, parameter_overrides=overrides)


@pytest.fixture(scope="module")
def standard(ros: None) -> Iterator[tuple[AdapterNode, Any, Any]]:
    """A node, and publishers of what it hears."""
    node, other = adapter(Standard), rclpy.create_node("autopilot")
    publishers = [other.create_publisher(*one, 100) for one in ((Imu, IMU), (FluidPressure, PRESSURE))]
    while not all(publisher.get_subscription_count() for publisher in publishers):
        rclpy.spin_once(node, timeout_sec=0.05)
    yield node, *publishers
    node.destroy_node()
    other.destroy_node()


def test_messages_go_through(probe: Probe) -> None:
    node = adapter(Standard, air_temperature=15.0)
    heard: dict[str, Any] = {}
    for kind, topic in ((Imu, "imu/data"), (AirData, "air_data"), (JointState, "actuators")):
        probe.node.create_subscription(kind, topic, partial(heard.__setitem__, topic), 10)
    imu, pressure = (probe.node.create_publisher(*one, 10) for one in ((Imu, IMU), (FluidPressure, PRESSURE)))
    force, rate = Vector3(x=0.5, y=0.25, z=9.75), Vector3(x=0.5, y=-0.25, z=0.125)
    said = Imu(header=conversion.header(STAMP, "base_link"), linear_acceleration=force, angular_velocity=rate)

    def all_heard() -> bool:
        imu.publish(said)
        for variance in (0.0, 0.25):
            header = conversion.header(STAMP, "")
            pressure.publish(FluidPressure(header=header, fluid_pressure=101325.0, variance=variance))
        for _ in range(10):
            rclpy.spin_once(node, timeout_sec=0.01)
        probe.spin(0.1)
        return len(heard) == 3

    try:
        probe.until(lambda: all_heard() and "adapter: input" in probe.diagnostics)
    finally:
        node.destroy_node()
    assert (heard["imu/data"].linear_acceleration, heard["imu/data"].angular_velocity) == (force, rate)
    assert heard["imu/data"].orientation_covariance[0] == -1.0, "no attitude"
    air = heard["air_data"]
    assert (air.true_airspeed, air.air_density) == pytest.approx((20.0, 1.225), rel=1e-4)
    assert math.isnan(air.angle_of_attack) and math.isnan(air.sideslip)
    assert (list(heard["actuators"].name), list(heard["actuators"].position)) == (["elevator"], [0.25])
    assert {conversion.stamp_ns(message.header.stamp) for message in heard.values()} == {STAMP}
    assert probe.diagnostics["adapter: input"].hardware_id == "mine"


ANY = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(values=st.tuples(*[ANY] * 12), seconds=st.integers(-(2**31), 2**31 - 1), nanoseconds=st.integers(0, 2**32 - 1))
def test_whatever_an_autopilot_sends_it_goes_on(
    standard: tuple[AdapterNode, Any, Any], values: tuple[float, ...], seconds: int, nanoseconds: int
) -> None:
    """What goes wrong in a callback is raised by ``spin_once``."""
    node, imu, pressure = standard
    header = Header(stamp=Time(sec=seconds, nanosec=nanoseconds))
    axes = [dict(zip("xyz", values[i : i + 3], strict=True)) for i in (0, 3)]
    imu.publish(Imu(header=header, linear_acceleration=Vector3(**axes[0]), angular_velocity=Vector3(**axes[1])))
    for variance in (0.0, values[6]):
        pressure.publish(FluidPressure(header=header, fluid_pressure=values[7], variance=variance))
    imu.publish(serialize_message(Imu(header=header))[:-9])
    for _ in range(6):
        rclpy.spin_once(node, timeout_sec=0.002)


def test_what_is_sound_is_passed_on_afterwards(standard: tuple[AdapterNode, Any, Any], probe: Probe) -> None:
    """By the node that has had all the messages of the test above."""
    node, imu, _ = standard
    heard: list[Imu] = []
    probe.node.create_subscription(Imu, "imu/data", heard.append, 10)
    sound = Imu(header=conversion.header(STAMP, "base_link"), linear_acceleration=Vector3(z=9.75))

    def passed_on() -> bool:
        imu.publish(sound)
        rclpy.spin_once(node, timeout_sec=0.05)
        probe.spin(0.05)
        return any(message.linear_acceleration == sound.linear_acceleration for message in heard)

    probe.until(passed_on)
    assert {conversion.stamp_ns(message.header.stamp) for message in heard} == {STAMP}


@settings(max_examples=100, deadline=None)
@given(
    values=st.lists(st.floats(width=32, allow_nan=True, allow_infinity=True), min_size=11, max_size=11),
    stamps=st.tuples(*[st.integers(0, 2**64 - 1)] * 2),
    source=st.integers(-128, 127),
)
def test_whatever_a_px4_sends_has_samples(values: list[float], stamps: tuple[int, int], source: int) -> None:
    """Its messages are not installed here; any object with their fields will do."""
    px4 = Px4(AdapterSettings("elevator=servo1:0:1 throttle=motor1:0:1"))
    both = {"timestamp": stamps[0], "timestamp_sample": stamps[1], "control": values[:8], "rho": values[8]}
    imu = {"gyro_rad": values[:3], "accelerometer_m_s2": values[3:6], "accelerometer_timestamp_relative": 0}
    air = {"airspeed_source": source, "true_airspeed_m_s": values[9]}
    constant = {"RELATIVE_TIMESTAMP_INVALID": 2**31 - 1}
    message = SimpleNamespace(q=[1.0, 0.0, 0.0, 0.0], **both, **imu, **air, **constant)
    for stamp in stamps:
        message.timestamp = stamp
        heard = [px4.hear(topic, message) for topic in px4.topics]
        samples = [sample for sample in heard if sample is not None]
        assert [type(sample) for sample in samples] == [ImuSample, AirSample, JointSample]
        assert {sample.stamp_ns for sample in samples} == {1000 * stamp}


def test_a_stamp_that_ros_cannot_hold_is_said(standard: tuple[AdapterNode, Any, Any], probe: Probe, capfd: Any) -> None:
    """It ended the node."""
    node, imu, _ = standard
    said = ""

    def heard() -> bool:
        nonlocal said
        imu.publish(Imu(header=Header(stamp=Time(sec=2**31 - 1, nanosec=2**32 - 1))))
        rclpy.spin_once(node, timeout_sec=0.05)
        said += capfd.readouterr().err
        return f"{IMU}: " in said and "messages are stamped beyond January 2038" in said

    probe.until(heard)


def test_silence_is_said_under_the_autopilots_topic(
    standard: tuple[AdapterNode, Any, Any], probe: Probe, capfd: Any
) -> None:
    """By a node that has said nothing yet: what is said is said again after ten seconds only."""
    node, imu, said = adapter(Standard), standard[1], ""

    def heard() -> bool:
        nonlocal said
        imu.publish(Imu(header=Header(stamp=probe.node.get_clock().now().to_msg())))
        rclpy.spin_once(node, timeout_sec=0.05)
        said += capfd.readouterr().err
        return f"{PRESSURE}: no message " in said

    try:
        probe.until(lambda: imu.get_subscription_count() > 1)
        probe.until(heard)
    finally:
        node.destroy_node()
    assert f"{IMU}: no message " not in said.partition(f"{PRESSURE}: no message ")[2]


def test_an_attitude_is_published_in_ros_axes() -> None:
    euler = np.array([[0.3, -0.2, 1.1]])
    x, y, z, w = quaternion_from_euler(euler, "frd")[0]
    message = imu_message(ImuSample(STAMP, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), Attitude(w, x, y, z)))
    q = message.orientation
    np.testing.assert_allclose(euler_from_quaternion(np.array([[q.x, q.y, q.z, q.w]]), "flu"), euler, atol=1e-12)
    assert message.orientation_covariance[0] == 0.0


def test_it_does_not_hear_itself(ros: None) -> None:
    with pytest.raises(InputError, match="topic /imu/data is both the autopilot's and the adapter's: start"):
        adapter(Deaf)


def test_a_parameter_does_not_change_in_flight(ros: None) -> None:
    node = adapter(Standard)
    try:
        result = node.set_parameters([Parameter("joints", value="rudder=out1:0:1")])[0]
    finally:
        node.destroy_node()
    assert (result.successful, result.reason) == (False, "joints takes effect when the node starts: start it again")


@pytest.mark.skipif(find_spec("px4_msgs") is not None, reason="px4_msgs is installed")
def test_a_missing_package_is_named() -> None:
    with pytest.raises(
        InputError, match=r"messages px4_msgs/msg/SensorCombined are not installed: build github.com/PX4"
    ):
        message_class("px4_msgs/msg/SensorCombined", Px4)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "parameter autopilot = '': expected one of px4, mavros, rosflight"),
        (("-p", "autopilot:=px4"), "parameter joints is empty"),
        (("-p", "autopilot:=px4", "-p", "air_temperature:=288.0"), "air_temperature = 288.0"),
    ],
)
def test_what_is_wrong_ends_the_program_with_a_line(options: tuple[str, ...], words: str) -> None:
    command = [sys.executable, "-m", "sysid_node.ros.adapter", "--ros-args", *options]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr


def test_shipped_file_is_the_table() -> None:
    text = (ROOT / "config" / "adapter.yaml").read_text(encoding="utf-8")
    assert text == parameter_file()
    assert yaml.safe_load(text)["/**"]["ros__parameters"] == {p.name: p.default for p in PARAMETERS}
