"""What the nodes of the closed loop share: a table of parameters, raw subscriptions, diagnostics once a second."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.cdr.layout import DamageError
from sysid_node.flight.cdr.message_reader import MessageReader
from sysid_node.flight.live import messages
from sysid_node.flight.live.conditions import Conditions, ReportedStates
from sysid_node.flight.live.messages import LATEST_SECONDS, TOO_LATE, UNREADABLE, Numbers, Paths, Texts
from sysid_node.flight.live.monitor import TopicMonitor
from sysid_node.parameter import NodeParameter, check_each
from sysid_node.ros.support import conversion
from sysid_node.ros.support.aircraft import aircraft_of
from sysid_node.ros.support.declaring import declare, values_of
from sysid_node.ros.support.message_types import fields_of
from sysid_node.ros.support.silence import UNHEARD, ClockWatch, joined, several_publishers, why_silent
from sysid_node.ros.support.spin import while_ros_is_up

COMMAND = "actuators/command"
SET_POINTS = "set_points"
DERIVATIVES = "identifier/derivatives"
CORRELATION = "identifier/correlation"

#: A short queue: old messages are of no use to a controller.
LATEST = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)

#: Best effort, as sensor data are published; deep enough for a burst after a pause of the process.
SENSOR_QOS = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)

#: Best effort takes publishers of either reliability.
SET_POINT_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)

#: The last message is kept for those who subscribe later.
LAST_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

#: The parameter of the nodes that model the surfaces.
LAG = ("actuator_lag", "s", "First-order lag of the surfaces behind their commands.", "For every aircraft.")
#: What is said of a topic whose messages are left out for their stamps.
STANDING = "its stamps do not advance, messages are left out"
EFFECT = "They take effect when the node starts; effects of the flight_simulator at any time."


class LoopNode(Node, ABC):
    """A node with a table of parameters, of which those in ``live`` may change in flight."""

    def __init__(self, name: str, table: Sequence[NodeParameter], live: frozenset[str] = frozenset()) -> None:
        super().__init__(name)
        self.inputs: dict[str, TopicMonitor] = {}  # by topic; the monitors' names are the resolved ones
        self.present: Mapping[str, str] = {}  # the conditions that were found last
        self._needed: dict[str, Any] = {}  # subscriptions to topics without which the node cannot do its work
        self._left_out: Counter[tuple[str, str]] = Counter()  # since the last report, by resolved topic and reason
        self._foreign = ""  # the aircraft whose estimates came since the last report, where it is another one
        self._conditions, self._states = Conditions(), ReportedStates()
        self._clock_watch = ClockWatch(self)
        self._table, self._live = table, live
        declare(self, table, lambda values: check_each(table, values))
        self.values = values_of(self, table)
        self.aircraft = aircraft_of(self, self.values["aircraft"])
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.add_on_set_parameters_callback(self._on_parameters)
        self.every(1.0, self._on_tick)

    def changed(self, values: Mapping[str, Any]) -> None:
        """Take new values of live parameters. Raises InputError where they are wrong."""

    @abstractmethod
    def words(self) -> tuple[bytes, str, Mapping[str, object]]:
        """Level, message and values for /diagnostics."""

    def conditions(self) -> Mapping[str, str]:
        """What is wrong now, besides silent inputs: subject -> text. It is said in the log."""
        return {}

    def states(self) -> Mapping[str, str]:
        """What the node does: subject -> text. Changes are said in the log."""
        return {}

    def listen(
        self,
        kind: Any,
        topic: str,
        paths: Paths,
        take: Callable[[Numbers, Texts], None],
        profile: QoSProfile | int,
        needed: bool = True,
    ) -> None:
        """Subscribe to the numbers and texts at ``paths`` of messages that stay serialised; leave bad ones out.

        Bad messages cannot be read, or are stamped too late; they are counted. To make objects of all parts of a
        message would take longer than the work on it. Where a topic that is ``needed`` is silent, the node says so.
        """
        reader = MessageReader(fields_of, f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}", *paths)

        def on_message(raw: bytes) -> None:
            try:
                message = reader.read(raw)
                reason = TOO_LATE if message[0][0] >= LATEST_SECONDS else ""
            except DamageError:
                reason = UNREADABLE
            if reason:
                self._left_out[self.inputs[topic].name, reason] += 1
            else:
                take(*message)

        self.hear(kind, topic, on_message, profile, needed, raw=True)

    def hear(
        self,
        kind: Any,
        topic: str,
        take: Callable[[Any], None],
        profile: QoSProfile | int,
        needed: bool = True,
        raw: bool = False,
    ) -> None:
        """Subscribe to messages, and count them."""
        monitor = self.inputs[topic] = TopicMonitor(topic)

        def on_message(message: Any) -> None:
            monitor.arrived()
            take(message)

        careful = while_ros_is_up(self, on_message)
        subscription = self.create_subscription(kind, topic, careful, profile, raw=raw)
        monitor.name = subscription.topic_name
        if needed:
            self._needed[topic] = subscription

    def is_ours(self, message: Any) -> bool:
        """Whether estimates are of this node's aircraft; those of another one are to be left out, and are reported."""
        ours: bool = message.aircraft == self.aircraft.name
        self._foreign = self._foreign if ours else message.aircraft
        return ours

    def every(self, period: float, callback: Any) -> None:
        """Call back every ``period`` s of a clock that never jumps."""
        self.create_timer(period, while_ros_is_up(self, callback), clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_parameters(self, changes: Sequence[Any]) -> SetParametersResult:
        changed = {c.name: c.value for c in changes if any(c.name == p.name for p in self._table)}
        try:
            fixed = sorted(changed.keys() - self._live)
            if fixed:
                raise InputError(f"{fixed[0]} takes effect when the node starts: start it again")
            self.changed(changed)
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _on_tick(self) -> None:
        silent = self._silent()
        left_out = {name: f"{count} messages are {why}" for (name, why), count in self._left_out.items()}
        self._left_out.clear()
        foreign = self._foreign_estimates()
        self.present = {**self.conditions(), **foreign}
        doubled = several_publishers(self, self._needed.values())
        say(self, self._conditions.update(joined({**silent, **left_out, **self.present}, doubled)))
        for line in self._states.update(self.states()):
            self.get_logger().warning(line)
        level, line, values = self.words()
        missing = [f"{name}: {text}" for name, text in {**silent, **left_out, **foreign}.items() if name not in line]
        missing += [f"{name}: {text}" for name, text in doubled.items()]
        pairs = [KeyValue(key=k, value=f"{v:.6g}" if isinstance(v, float) else str(v)) for k, v in values.items()]
        status = DiagnosticStatus(
            level=max(level, DiagnosticStatus.WARN) if missing else level,
            name=f"{full_name(self)}: state",
            message="; ".join([line, *missing]),
            hardware_id=self.aircraft.name,
            values=pairs,
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _foreign_estimates(self) -> dict[str, str]:
        """The topic of estimates with what is wrong with it, where they were of another aircraft."""
        foreign, self._foreign = self._foreign, ""
        if not foreign:
            return {}
        words = f"of aircraft {foreign!r}, left out: this node's is {self.aircraft.name!r}"
        return {self.inputs[DERIVATIVES].name: words}

    def _silent(self) -> dict[str, str]:
        """The needed topics without a message for ``UNHEARD`` s, by resolved name; and /clock."""
        return self._clock_watch.missing() | {
            self.inputs[topic].name: waiting(self, self.inputs[topic], subscription)
            for topic, subscription in self._needed.items()
            if self.inputs[topic].waited() > UNHEARD
        }


def waiting(node: Node, monitor: TopicMonitor, subscription: Any) -> str:
    """Since when a topic is silent, and why."""
    since = f"no message for {monitor.waited():.1f} s" if monitor.received else "no message yet"
    return since + why_silent(node, subscription)


def say(node: Node, lines: Iterable[tuple[bool, str]]) -> None:
    """Log lines, as warnings where they are."""
    for wrong, line in lines:
        if wrong:  # a line each: rclpy knows a call by its line, and wants one severity of each
            node.get_logger().warning(line)
        else:
            node.get_logger().info(line)


def expected_joints(aircraft: Aircraft) -> list[str]:
    """The joints that messages about actuators must name."""
    joints = [joint for control in aircraft.controls.values() for joint in control.joints]
    return list(dict.fromkeys([*joints, *([aircraft.throttle.joint] if aircraft.throttle else [])]))


def full_name(node: Node) -> str:
    """The node's name with its namespace, without the first slash."""
    return str(node.get_fully_qualified_name()).lstrip("/")


def named(stamp_ns: int, values: Mapping[str, float]) -> JointState:
    """The message of numbers by name."""
    return JointState(
        header=conversion.header(stamp_ns, ""), name=list(values), position=[float(v) for v in values.values()]
    )


def by_name(numbers: Numbers, texts: Texts) -> tuple[int, dict[str, float]]:
    """The stamp (ns) and the numbers by name of such a message; names without a position are left out."""
    stamp, names, positions = messages.actuators(numbers, texts)
    return stamp, dict(zip(names, positions, strict=False))
