"""Flies in closed loop: `ros2 launch sysid_node closed_loop.launch.py aircraft:=cdrw`.

Simulator, identifier, exciter, fault monitor and controller; `bag:=NAME` records what they say. Then
`ros2 service call /exciter/start std_srvs/srv/Trigger`, and let something fail:
`ros2 param set /flight_simulator effects control_effectiveness_loss:elevator=0.6`.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import LifecycleNode, Node

CONFIG = Path(get_package_share_directory("sysid_node"), "config")
RECORDED = (
    *("imu/data", "air_data", "actuators", "actuators/command", "actuators/excitation", "set_points"),
    *("identifier/derivatives", "adaptive_controller/tracking", "fault_monitor/faults", "pose", "/diagnostics"),
)


def generate_launch_description() -> LaunchDescription:
    """Five nodes, each with its file of parameters, and a recorder where a bag is named."""
    aircraft = {"aircraft": LaunchConfiguration("aircraft")}

    def described(name: str, **own: object) -> dict[str, object]:
        parameters = [str(CONFIG / f"{name}.yaml"), aircraft, own]
        return {"package": "sysid_node", "executable": name, "name": name, "parameters": parameters, "output": "screen"}

    bag = LaunchConfiguration("bag")
    return LaunchDescription(
        [
            DeclareLaunchArgument("aircraft", default_value="cdrw", description="a name, or an aircraft file"),
            DeclareLaunchArgument("turbulence", default_value="none", description="none, light, moderate or severe"),
            DeclareLaunchArgument("adapt", default_value="true", description="false: the aircraft file's gains"),
            DeclareLaunchArgument("method", default_value="sls_rft", description="of the identifier; iv_rft in gusts"),
            DeclareLaunchArgument("bag", default_value="", description="folder to record into; empty: none"),
            Node(**described("flight_simulator", turbulence=LaunchConfiguration("turbulence"))),
            LifecycleNode(namespace="", **described("identifier", method=LaunchConfiguration("method"))),
            Node(**described("exciter", watch=True, accuracy=0.15)),
            Node(**described("fault_monitor")),
            Node(**described("adaptive_controller", adapt=LaunchConfiguration("adapt"))),
            ExecuteProcess(
                cmd=["ros2", "bag", "record", "-o", bag, *RECORDED],
                condition=IfCondition(PythonExpression(["'", bag, "' != ''"])),
            ),
        ]
    )
