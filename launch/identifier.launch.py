"""Starts the identifier: `ros2 launch sysid_node identifier.launch.py aircraft:=cdrw`."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode

DEFAULTS = Path(get_package_share_directory("sysid_node"), "config", "identifier.yaml")


def generate_launch_description() -> LaunchDescription:
    """The node, its parameters from a file, the aircraft given on top."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("aircraft", description="a name in config/aircraft, or an aircraft file"),
            DeclareLaunchArgument("parameters", default_value=str(DEFAULTS), description="parameter file"),
            DeclareLaunchArgument("namespace", default_value="", description="namespace of node and topics"),
            LifecycleNode(
                package="sysid_node",
                executable="identifier",
                name="identifier",
                namespace=LaunchConfiguration("namespace"),
                parameters=[LaunchConfiguration("parameters"), {"aircraft": LaunchConfiguration("aircraft")}],
                output="screen",
            ),
        ]
    )
