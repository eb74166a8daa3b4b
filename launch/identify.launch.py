"""Starts the identifier beside any autopilot: `ros2 launch sysid_node identify.launch.py aircraft:=cdrw`.

Where the autopilot's topics have other names: `imu:=/mavros/imu/data actuators:=/servo_states`.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode

DEFAULTS = Path(get_package_share_directory("sysid_node"), "config", "identifier.yaml")
TOPICS = {"imu": "imu/data", "air_data": "air_data", "actuators": "actuators"}


def generate_launch_description() -> LaunchDescription:
    """The node, its parameters from a file, the aircraft given on top, its topics as the autopilot names them."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("aircraft", description="a name in config/aircraft, or an aircraft file"),
            DeclareLaunchArgument("parameters", default_value=str(DEFAULTS), description="parameter file"),
            DeclareLaunchArgument("namespace", default_value="", description="namespace of node and topics"),
            *(
                DeclareLaunchArgument(name, default_value=topic, description=f"the autopilot's topic for {topic}")
                for name, topic in TOPICS.items()
            ),
            LifecycleNode(
                package="sysid_node",
                executable="identifier",
                name="identifier",
                namespace=LaunchConfiguration("namespace"),
                parameters=[LaunchConfiguration("parameters"), {"aircraft": LaunchConfiguration("aircraft")}],
                remappings=[(topic, LaunchConfiguration(name)) for name, topic in TOPICS.items()],
                output="screen",
            ),
        ]
    )
