"""Transforms and markers over DDS, where their message packages are installed (there are none on PyPI)."""

from importlib.util import find_spec

import pytest

from sysid_node.cli.live.markers import NEEDED, MarkerPublisher

if not all(find_spec(name) for name in ("rclpy", *NEEDED)):
    pytest.skip(f"not all installed: rclpy, {', '.join(NEEDED)}", allow_module_level=True)

import rclpy
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

import sysid_node.ros  # finds sysid_msgs in a virtual environment
from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.live.ros_domain import own_domain
from sysid_node.ros.support.conversion import header
from sysid_node.ros.support.flight_watch import FlightWatch

assert sysid_node.ros
own_domain()


def test_published_transforms_and_markers() -> None:
    """A level flight due east at 20 m/s, heard by a node on the topics of tf2 and RViz."""
    if not rclpy.ok():
        rclpy.init()
    node, watch = rclpy.create_node("flight"), FlightWatch(name="markers")
    publisher = MarkerPublisher(load_aircraft("cdrw"), watch, "map", "base_link", transforms=True)
    frames, arrays = [], []
    node.create_subscription(TFMessage, "/tf", lambda m: frames.extend(m.transforms), 100)
    node.create_subscription(MarkerArray, "/markers/markers", arrays.append, 100)
    imu, air = node.create_publisher(Imu, "imu/data", 100), node.create_publisher(AirData, "air_data", 100)
    joints = node.create_publisher(JointState, "actuators", 100)
    for _ in range(200):  # until all have found each other
        watch.listen(0.05)
        outputs = ("/tf", "/markers/markers")
        known = all(one.get_subscription_count() for one in (imu, air, joints))
        if known and all(watch.node.count_subscribers(topic) and node.count_publishers(topic) for topic in outputs):
            break
    for tick in range(150):
        at = 0.02 * tick
        stamp = header(1_700_000_000_000_000_000 + round(1e9 * at), "base_link")
        message = Imu(header=stamp)
        message.orientation.w = 1.0
        imu.publish(message)
        air.publish(AirData(header=stamp, true_airspeed=20.0, angle_of_attack=0.0, air_density=1.2))
        names = ["elevator", "aileron", "rudder", "throttle"]
        joints.publish(JointState(header=stamp, name=names, position=[0.2, 0.0, 0.0, 0.5]))
        watch.listen(0.01)
        publisher.publish()
        rclpy.spin_once(node, timeout_sec=0.01)
    watch.close()
    node.destroy_node()
    first, last = frames[0], frames[-1]
    assert (last.header.frame_id, last.child_frame_id) == ("map", "base_link")
    seconds = (last.header.stamp.sec - first.header.stamp.sec) + 1e-9 * (
        last.header.stamp.nanosec - first.header.stamp.nanosec
    )
    moved = last.transform.translation.x - first.transform.translation.x
    assert seconds > 1.0
    assert moved == pytest.approx(20.0 * seconds, abs=1.0)
    assert last.transform.rotation.w == pytest.approx(1.0)
    by_name = {(m.ns, m.id): m for m in arrays[-1].markers}
    airframe = by_name["aircraft", 0]
    assert airframe.type == Marker.TRIANGLE_LIST
    assert airframe.header.frame_id == "base_link"
    wing = [p.y for p in airframe.points]
    assert max(wing) - min(wing) == pytest.approx(load_aircraft("cdrw").geometry.b)
    assert by_name["trail", 0].header.frame_id == "map"
    assert len(by_name["trail", 0].points) > 5
    assert by_name["text", 0].text
