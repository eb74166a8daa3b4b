"""Flies in closed loop: `ros2 launch sysid_node closed_loop.launch.py aircraft:=cdrw`.

Simulator, identifier, exciter, fault monitor and controller; `bag:=NAME` records what they say. Then
`ros2 service call /exciter/start std_srvs/srv/Trigger`, and let something fail:
`ros2 param set /flight_simulator effects "actuator_lag:time_constant=0.05 control_effectiveness_loss:elevator=0.6"`.
When one of the nodes ends, all of them do.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import LifecycleNode, Node
from launch_ros.parameter_descriptions import ParameterValue

CONFIG = Path(get_package_share_directory("sysid_node"), "config")
RECORDED = (
    *("imu/data", "air_data", "actuators", "actuators/command", "actuators/excitation", "set_points"),
    *("identifier/derivatives", "identifier/model_gap", "identifier/correlation"),
    *("adaptive_controller/tracking", "fault_monitor/faults", "pose"),
)


def arguments() -> list[DeclareLaunchArgument]:
    """What can be given on the command line."""
    return [
        DeclareLaunchArgument("aircraft", default_value="cdrw", description="a name, or an aircraft file"),
        DeclareLaunchArgument("namespace", default_value="", description="namespace of nodes and topics"),
        DeclareLaunchArgument(
            "turbulence",
            default_value="none",
            description="Dryden turbulence",
            choices=["none", "light", "moderate", "severe"],
        ),
        DeclareLaunchArgument(
            "speed", default_value="1.0", description="how many times as fast as real time; the nodes use /clock"
        ),
        DeclareLaunchArgument(
            "effects",
            default_value="actuator_lag:time_constant=0.05",
            description="what makes the aircraft differ from its file: name:key=value, a space between",
        ),
        DeclareLaunchArgument(
            "surfaces",
            default_value="measured",
            description="what the topic actuators carries: positions of the surfaces, or commands",
            choices=["measured", "commanded"],
        ),
        DeclareLaunchArgument(
            "adapt",
            default_value="true",
            description="false: the aircraft file's gains, whatever is identified",
            choices=["true", "false"],
        ),
        DeclareLaunchArgument(
            "method",
            default_value="sls_rft",
            description="of the identifier; iv_rft in gusts",
            choices=["sls_rft", "iv_rft"],
        ),
        DeclareLaunchArgument("bag", default_value="", description="folder to record into; empty: none"),
    ]


def generate_launch_description() -> LaunchDescription:
    """Five nodes, each with its file of parameters, and a recorder where a bag is named."""
    argument, value = LaunchConfiguration, ParameterValue
    speed, bag, namespace = argument("speed"), argument("bag"), argument("namespace")
    aircraft = {"aircraft": value(argument("aircraft"), value_type=str)}
    simulated = {"use_sim_time": value(PythonExpression(["float(", speed, ") != 1.0"]), value_type=bool)}

    def described(name: str, **own: object) -> dict[str, object]:
        return {
            "package": "sysid_node",
            "executable": name,
            "name": name,
            "namespace": namespace,
            "parameters": [str(CONFIG / f"{name}.yaml"), aircraft, own],
            "output": "screen",
            "on_exit": Shutdown(reason=f"{name} has ended"),
        }

    sky = {
        "turbulence": value(argument("turbulence"), value_type=str),
        "speed": value(speed, value_type=float),
        "effects": value(argument("effects"), value_type=str),
        "surfaces": value(argument("surfaces"), value_type=str),
    }
    surfaces = ["'commands' if '", argument("surfaces"), "' == 'commanded' else 'positions'"]
    identification = {
        "method": value(argument("method"), value_type=str),
        "actuators": value(PythonExpression(surfaces), value_type=str),
    }
    adapt = value(argument("adapt"), value_type=bool)
    prefix = PythonExpression(["('/' + '", namespace, "'.strip('/')).rstrip('/')"])
    topics = [[prefix, f"/{topic}"] for topic in RECORDED]
    return LaunchDescription(
        [
            *arguments(),
            Node(**described("flight_simulator", **sky)),
            LifecycleNode(**described("identifier", **identification, **simulated)),
            Node(**described("exciter", watch=True, accuracy=0.15, **simulated)),
            Node(**described("fault_monitor", **simulated)),
            Node(**described("adaptive_controller", adapt=adapt, **simulated)),
            ExecuteProcess(
                cmd=["ros2", "bag", "record", "-o", bag, *topics, "/diagnostics"],
                condition=IfCondition(PythonExpression(["'", bag, "' != ''"])),
            ),
        ]
    )
