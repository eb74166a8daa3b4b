"""Inputs read from serialised messages. Truth: rclpy's own serialisation of the same numbers."""

import math

import pytest
from geometry_msgs.msg import Quaternion, Vector3
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Header
from sysid_msgs.msg import AirData

from sysid_node.flight.cdr.message_reader import MessageReader
from sysid_node.flight.live import messages
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU, INPUT_TOPICS
from sysid_node.ros.support.conversion import stamp_message
from sysid_node.ros.support.message_types import fields_of

STAMP = 1_700_000_000_123_456_789
FRAMES = ("", "imu", "a/frame/of/another/length")


def read(topic: str, message: object) -> tuple[messages.Numbers, messages.Texts]:
    return MessageReader(fields_of, INPUT_TOPICS[topic], *messages.PATHS[topic]).read(serialize_message(message))


@pytest.mark.parametrize("frame", FRAMES)
def test_imu(frame: str) -> None:
    message = Imu(
        header=Header(stamp=stamp_message(STAMP), frame_id=frame),
        linear_acceleration=Vector3(x=1.0, y=2.0, z=3.0),
        angular_velocity=Vector3(x=0.1, y=-0.2, z=-0.3),
    )
    numbers, texts = read(IMU, message)
    assert texts == (frame,)
    assert messages.imu(numbers, "flu") == (STAMP, (1.0, -2.0, -3.0, 0.1, 0.2, 0.3))
    assert messages.imu(numbers, "frd") == (STAMP, (1.0, 2.0, 3.0, 0.1, -0.2, -0.3))


def test_level_flight_in_either_frame() -> None:
    """At rest an accelerometer reads +g upwards: (0, 0, 9.8) FLU, (0, 0, -9.8) FRD (REP-103). Nose up: q > 0 in FRD."""
    flu = Imu(linear_acceleration=Vector3(z=9.8), angular_velocity=Vector3(x=0.1, y=-0.2, z=-0.3))
    frd = Imu(linear_acceleration=Vector3(z=-9.8), angular_velocity=Vector3(x=0.1, y=0.2, z=0.3))
    assert messages.imu(read(IMU, flu)[0], "flu") == (0, (0.0, 0.0, -9.8, 0.1, 0.2, 0.3))
    assert messages.imu(read(IMU, frd)[0], "frd") == (0, (0.0, 0.0, -9.8, 0.1, 0.2, 0.3))


@pytest.mark.parametrize("frame", FRAMES)
def test_attitude(frame: str) -> None:
    """Nose up by 0.2 rad is a turn by -0.2 about the left wing (REP-103); a covariance of -1 is none (REP-145)."""
    message = Imu(
        header=Header(stamp=stamp_message(STAMP), frame_id=frame),
        orientation=Quaternion(y=-math.sin(0.1), w=math.cos(0.1)),
        linear_acceleration=Vector3(z=9.8),
        angular_velocity=Vector3(x=0.1),
    )
    reader = MessageReader(fields_of, INPUT_TOPICS[IMU], *messages.ATTITUDE_PATHS)
    stamp, values, (roll, pitch) = messages.imu_and_attitude(reader.read(serialize_message(message))[0], "flu")
    assert (stamp, values) == (STAMP, (0.0, 0.0, -9.8, 0.1, 0.0, 0.0))
    assert (roll, pitch) == pytest.approx((0.0, 0.2), abs=1e-12)
    message.orientation_covariance[0] = -1.0
    *_, attitude = messages.imu_and_attitude(reader.read(serialize_message(message))[0], "flu")
    assert all(map(math.isnan, attitude))


def test_attitude_of_a_driver_in_forward_right_down_axes() -> None:
    """Nose up by 0.2 rad is a turn by 0.2 about the right wing (of NED); at rest it reads -g along z."""
    message = Imu(
        orientation=Quaternion(y=math.sin(0.1), w=math.cos(0.1)),
        linear_acceleration=Vector3(z=-9.8),
        angular_velocity=Vector3(y=0.2, z=0.3),
    )
    reader = MessageReader(fields_of, INPUT_TOPICS[IMU], *messages.ATTITUDE_PATHS)
    _, values, (roll, pitch) = messages.imu_and_attitude(reader.read(serialize_message(message))[0], "frd")
    assert values == (0.0, 0.0, -9.8, 0.0, 0.2, 0.3)
    assert (roll, pitch) == pytest.approx((0.0, 0.2), abs=1e-12)


@pytest.mark.parametrize("frame", FRAMES)
def test_air_data(frame: str) -> None:
    header = Header(stamp=stamp_message(STAMP), frame_id=frame)
    message = AirData(header=header, true_airspeed=18.0, angle_of_attack=0.1, sideslip=-0.2, air_density=1.2)
    assert messages.air_data(read(AIR_DATA, message)[0]) == (STAMP, (18.0, 0.1, -0.2, 1.2))


@pytest.mark.parametrize("frame", FRAMES)
def test_actuators(frame: str) -> None:
    header = Header(stamp=stamp_message(STAMP), frame_id=frame)
    message = JointState(header=header, name=["rudder", "throttle"], position=[0.25, 0.5], effort=[7.0])
    assert messages.actuators(*read(ACTUATORS, message)) == (STAMP, ("rudder", "throttle"), (0.25, 0.5))
    assert messages.actuators(*read(ACTUATORS, JointState())) == (0, (), ())
