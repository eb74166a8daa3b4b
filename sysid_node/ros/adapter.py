"""The node `adapter`: republishes an autopilot's own topics as the topics that the identifier listens to."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Quaternion, Vector3
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.attitude import other_axes
from sysid_node.flight.autopilots.base import (
    RANGES,
    Adapter,
    AdapterSettings,
    AirSample,
    ImuSample,
    JointSample,
    Sample,
    Vector,
    adapter_for,
)
from sysid_node.flight.autopilots.known import ADAPTERS
from sysid_node.flight.checks import LATEST_STAMP_NS
from sysid_node.flight.live.conditions import Conditions
from sysid_node.flight.live.messages import TOO_LATE
from sysid_node.flight.live.monitor import TopicMonitor
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.parameter import NodeParameter, annotated_yaml, check_each
from sysid_node.ros.support import conversion
from sysid_node.ros.support.declaring import declare, values_of
from sysid_node.ros.support.diagnostics import DiagnosticSource
from sysid_node.ros.support.loop_node import full_name, say, waiting
from sysid_node.ros.support.silence import UNHEARD, ClockWatch
from sysid_node.ros.support.spin import run_node, while_ros_is_up

#: Autopilots' bridges publish best effort. The queue is deep enough for a burst after a pause of the process.
INPUT_QOS = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)

_DEFAULT = AdapterSettings()

PARAMETERS = (
    NodeParameter("autopilot", "", "", f"Whose topics: {', '.join(ADAPTERS)}. Needed.", "For every autopilot."),
    NodeParameter(
        "joints",
        _DEFAULT.joints,
        "",
        "Which output moves which joint, and how far: NAME=OUTPUT:TRIM:SCALE with spaces between. The joint's angle is "
        "SCALE (rad per unit of the output) times the output less TRIM; see docs/how-to/autopilots.md. Needed.",
        "For every aircraft: measure the surfaces at both ends of their travel.",
    ),
    NodeParameter(
        "air_temperature",
        _DEFAULT.air_temperature,
        "degC",
        "Outside air, for the density where the autopilot measures the pressure alone (mavros, rosflight).",
        "Before every flight: 3 degC are 1 % of the density.",
        *RANGES["air_temperature"],
    ),
    NodeParameter(
        "air_data_delay",
        _DEFAULT.air_data_delay,
        "s",
        "By so much airspeed is stamped too late, as where it is stamped when it arrives.",
        "To the link's latency where docs/how-to/autopilots.md says that stamps are times of arrival.",
        *RANGES["air_data_delay"],
    ),
    NodeParameter(
        "stale_after",
        0.5,
        "s",
        "A topic silent for longer is reported as stale on /diagnostics.",
        "Up where the autopilot publishes one of them more slowly.",
        lower=0.01,
        upper=3600.0,
    ),
)


class AdapterNode(Node):
    """``config/adapter.yaml`` explains its parameters.

    Raises InputError on wrong parameters, where the autopilot's message package is not installed, and where the node
    would receive its own messages. ``options`` are rclpy's.
    """

    def __init__(self, adapters: Mapping[str, type[Adapter]] = ADAPTERS, **options: Any) -> None:
        super().__init__("adapter", **options)
        declare(self, PARAMETERS, lambda values: check_each(PARAMETERS, values))
        values = values_of(self, PARAMETERS)
        self._name, self._stale_after = values["autopilot"], values["stale_after"]
        self._adapter = adapter_for(self._name, adapters, _settings(values))
        kinds = {topic: message_class(kind, self._adapter) for topic, kind in self._adapter.topics.items()}
        self._out: dict[type[Sample], tuple[Any, Callable[[Any], Any]]] = {
            ImuSample: (self.create_publisher(Imu, IMU, 100), imu_message),
            AirSample: (self.create_publisher(AirData, AIR_DATA, 100), air_message),
            JointSample: (self.create_publisher(JointState, ACTUATORS, 100), joint_message),
        }
        self._conditions, self._clock_watch = Conditions(), ClockWatch(self)
        self._left_out: Counter[str] = Counter()  # messages since the last report, by resolved topic
        self._heard = [self._listen(kind, topic) for topic, kind in kinds.items()]
        self._monitors = [monitor for monitor, _ in self._heard]
        self.add_on_set_parameters_callback(_refuse)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_timer(1.0, while_ros_is_up(self, self._on_tick), clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _listen(self, kind: Any, topic: str) -> tuple[TopicMonitor, Any]:
        monitor = TopicMonitor(topic)
        subscription = self.create_subscription(kind, topic, while_ros_is_up(self, self._on(topic, monitor)), INPUT_QOS)
        monitor.name = subscription.topic_name
        if subscription.topic_name in {publisher.topic_name for publisher, _ in self._out.values()}:
            raise InputError(
                f"topic {subscription.topic_name} is both the autopilot's and the adapter's: start the adapter and the "
                "identifier in a namespace, e.g. --ros-args -r __ns:=/sysid"
            )
        return monitor, subscription

    def _on(self, topic: str, monitor: TopicMonitor) -> Callable[[Any], None]:
        def receive(message: Any) -> None:
            monitor.arrived()
            try:
                sample = self._adapter.hear(topic, message)
            except AttributeError as error:  # the messages are of another release than the adapter knows
                raise InputError(f"topic {topic}: {error}; {self._adapter.remedy}") from error
            if sample is not None and abs(sample.stamp_ns) >= LATEST_STAMP_NS:
                self._left_out[monitor.name] += 1
            elif sample is not None:
                publisher, as_message = self._out[type(sample)]
                publisher.publish(as_message(sample))

        return receive

    def _on_tick(self) -> None:
        present = self._clock_watch.missing() | {
            monitor.name: waiting(self, monitor, subscription)
            for monitor, subscription in self._heard
            if monitor.waited() > UNHEARD
        }
        late = {name: f"{count} messages are {TOO_LATE}" for name, count in self._left_out.items()}
        self._left_out.clear()
        say(self, self._conditions.update({**late, **present}))
        status = DiagnosticSource(full_name(self), self._name).input(self._monitors, {}, self._stale_after)
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)


def message_class(kind: str, adapter: Adapter | type[Adapter]) -> Any:
    """The class of a message type. Raises InputError where its package is missing, or lacks the type."""
    package, _, name = kind.split("/")
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except (ImportError, AttributeError) as error:
        remedy = adapter.remedy if package == adapter.package else f"install {package}"
        raise InputError(f"messages {kind} are not installed: {remedy}") from error


def imu_message(sample: ImuSample) -> Imu:
    """The IMU message: axes forward-left-up, orientation relative to east-north-up, covariances unknown."""
    message = Imu(
        header=conversion.header(sample.stamp_ns, "base_link"),
        linear_acceleration=_flu(sample.force),
        angular_velocity=_flu(sample.rates),
    )
    if sample.attitude is None:
        message.orientation_covariance[0] = -1.0
    else:
        w, x, y, z = other_axes(sample.attitude)
        message.orientation = Quaternion(w=w, x=x, y=y, z=z)
    return message


def air_message(sample: AirSample) -> AirData:
    """The air data message. Its flow angles are NaN, as no autopilot publishes them."""
    return AirData(
        header=conversion.header(sample.stamp_ns, "air_data"),
        true_airspeed=sample.true_airspeed,
        angle_of_attack=sample.angle_of_attack,
        sideslip=sample.sideslip,
        air_density=sample.air_density,
    )


def joint_message(sample: JointSample) -> JointState:
    """The joint state message."""
    return JointState(
        header=conversion.header(sample.stamp_ns, ""), name=list(sample.names), position=list(sample.positions)
    )


def _flu(vector: Vector) -> Vector3:
    x, y, z = vector
    return Vector3(x=x, y=-y, z=-z)


def _settings(values: Mapping[str, Any]) -> AdapterSettings:
    return AdapterSettings(values["joints"], values["air_temperature"], values["air_data_delay"])


def _refuse(changes: Iterable[Any]) -> SetParametersResult:
    named = [change.name for change in changes if any(change.name == parameter.name for parameter in PARAMETERS)]
    reason = f"{named[0]} takes effect when the node starts: start it again" if named else ""
    return SetParametersResult(successful=not named, reason=reason)


def parameter_file() -> str:
    """The text of config/adapter.yaml."""
    text = annotated_yaml("adapter", PARAMETERS, "They take effect when the node starts.")
    return text.replace("aircraft:=cdrw", "autopilot:=px4")


def main() -> None:
    """Entry point of the node."""
    sys.exit(run_node(AdapterNode, __doc__ or "", PARAMETERS))


if __name__ == "__main__":
    main()
