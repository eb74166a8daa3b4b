"""Starts the identifier beside any autopilot: `ros2 launch sysid_node identify.launch.py aircraft:=cdrw`.

Where the autopilot's topics have other names: `imu:=/mavros/imu/data actuators:=/servo_states`. Where they have other
types, the adapter is started, too: `autopilot:=px4 joints:="elevator=servo2:0:0.44 ..." namespace:=sysid`.
When one of the nodes ends, all of them do.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import LifecycleNode, Node
from launch_ros.parameter_descriptions import ParameterValue

CONFIG = Path(get_package_share_directory("sysid_node"), "config")
TOPICS = {"imu": "imu/data", "air_data": "air_data", "actuators": "actuators"}


def arguments() -> list[DeclareLaunchArgument]:
    """What may be given on the command line."""
    return [
        DeclareLaunchArgument("aircraft", description="a name in config/aircraft, or an aircraft file"),
        DeclareLaunchArgument(
            "parameters", default_value=str(CONFIG / "identifier.yaml"), description="the identifier's parameter file"
        ),
        DeclareLaunchArgument("namespace", default_value="", description="namespace of nodes and topics"),
        DeclareLaunchArgument(
            "use_sim_time",
            default_value="false",
            description="true: the time of /clock, as beside a simulator or a player with --clock",
            choices=["true", "false"],
        ),
        DeclareLaunchArgument(
            "autopilot",
            default_value="",
            description="whose topics the adapter translates; empty: no adapter",
            choices=["", "px4", "mavros", "rosflight"],
        ),
        DeclareLaunchArgument(
            "adapter_parameters",
            default_value=str(CONFIG / "adapter.yaml"),
            description="the adapter's parameter file, as for the air's temperature and the delay of the air data",
        ),
        DeclareLaunchArgument(
            "joints", default_value="", description="of the adapter: NAME=OUTPUT:TRIM:SCALE with spaces between"
        ),
        *(
            DeclareLaunchArgument(name, default_value=topic, description=f"the autopilot's topic for {topic}")
            for name, topic in TOPICS.items()
        ),
    ]


def generate_launch_description() -> LaunchDescription:
    """The node, its parameters from a file, the aircraft given on top, its topics as the autopilot names them."""
    argument, value = LaunchConfiguration, ParameterValue
    simulated = {"use_sim_time": value(argument("use_sim_time"), value_type=bool)}
    autopilot, joints = (value(argument(name), value_type=str) for name in ("autopilot", "joints"))
    return LaunchDescription(
        [
            *arguments(),
            LifecycleNode(
                package="sysid_node",
                executable="identifier",
                name="identifier",
                namespace=argument("namespace"),
                parameters=[
                    argument("parameters"),
                    {"aircraft": value(argument("aircraft"), value_type=str), **simulated},
                ],
                remappings=[(topic, argument(name)) for name, topic in TOPICS.items()],
                output="screen",
                on_exit=Shutdown(reason="identifier has ended"),
            ),
            Node(
                package="sysid_node",
                executable="adapter",
                name="adapter",
                namespace=argument("namespace"),
                parameters=[argument("adapter_parameters"), {"autopilot": autopilot, "joints": joints, **simulated}],
                output="screen",
                condition=IfCondition(PythonExpression(["'", argument("autopilot"), "' != ''"])),
                on_exit=Shutdown(reason="adapter has ended"),
            ),
        ]
    )
