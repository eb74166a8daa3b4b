"""Inputs read from serialised messages. Truth: rclpy's own serialisation of the same numbers."""

import pytest
from geometry_msgs.msg import Vector3
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Header
from sysid_msgs.msg import AirData

from sysid_node.flight.cdr_single import SingleReader
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU, INPUT_TOPICS
from sysid_node.ros import inputs
from sysid_node.ros.conversion import stamp_message
from sysid_node.ros.message_types import fields_of

STAMP = 1_700_000_000_123_456_789
FRAMES = ("", "imu", "a/frame/of/another/length")


def read(topic: str, message: object) -> tuple[inputs.Numbers, inputs.Texts]:
    return SingleReader(fields_of, INPUT_TOPICS[topic], *inputs.FIELDS[topic]).read(serialize_message(message))


@pytest.mark.parametrize("frame", FRAMES)
def test_imu(frame: str) -> None:
    message = Imu(
        header=Header(stamp=stamp_message(STAMP), frame_id=frame),
        linear_acceleration=Vector3(x=1.0, y=2.0, z=3.0),
        angular_velocity=Vector3(x=0.1, y=-0.2, z=-0.3),
    )
    numbers, texts = read(IMU, message)
    assert texts == (frame,)
    assert inputs.imu(numbers, -1.0) == (STAMP, (1.0, -2.0, -3.0, 0.1, 0.2, 0.3))
    assert inputs.imu(numbers, 1.0) == (STAMP, (1.0, 2.0, 3.0, 0.1, -0.2, -0.3))


@pytest.mark.parametrize("frame", FRAMES)
def test_air_data(frame: str) -> None:
    header = Header(stamp=stamp_message(STAMP), frame_id=frame)
    message = AirData(header=header, true_airspeed=18.0, angle_of_attack=0.1, sideslip=-0.2, air_density=1.2)
    assert inputs.air_data(read(AIR_DATA, message)[0]) == (STAMP, (18.0, 0.1, -0.2, 1.2))


@pytest.mark.parametrize("frame", FRAMES)
def test_actuators(frame: str) -> None:
    header = Header(stamp=stamp_message(STAMP), frame_id=frame)
    message = JointState(header=header, name=["rudder", "throttle"], position=[0.25, 0.5], effort=[7.0])
    assert inputs.actuators(*read(ACTUATORS, message)) == (STAMP, ("rudder", "throttle"), (0.25, 0.5))
    assert inputs.actuators(*read(ACTUATORS, JointState())) == (0, (), ())
