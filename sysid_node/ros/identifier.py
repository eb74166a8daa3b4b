"""The node `identifier`: estimates stability and control derivatives in flight, from the aircraft's topics."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from sysid_msgs.msg import AirData, DerivativeEstimates, EstimateCorrelation, ModelGap

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.stated_effects import not_taken_in_words
from sysid_node.errors import InputError
from sysid_node.flight.cdr.layout import DamageError
from sysid_node.flight.cdr.message_reader import MessageReader, Text
from sysid_node.flight.frames import BodyFrame
from sysid_node.flight.live import messages
from sysid_node.flight.live.conditions import Conditions
from sysid_node.flight.live.messages import UNREADABLE, Numbers, Texts
from sysid_node.flight.live.monitor import Durations, TopicMonitor
from sysid_node.flight.live.recent_counts import RecentCounts, RecentTopic
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU, INPUT_TOPICS
from sysid_node.online.estimates.saving import save_estimates
from sysid_node.online.estimates.serialisation import EstimatesSerialiser
from sysid_node.online.parameters import LIVE, PARAMETERS, check, estimation_settings
from sysid_node.online.session import Due, Session
from sysid_node.online.settings import OnlineSettings
from sysid_node.ros.support import conversion
from sysid_node.ros.support.aircraft import aircraft_of
from sysid_node.ros.support.declaring import declare, refusal, values_of
from sysid_node.ros.support.diagnostics import DiagnosticSource, lag_level, lag_words, rejections
from sysid_node.ros.support.lifecycle import CarefulNode
from sysid_node.ros.support.loop_node import LAST_QOS, SENSOR_QOS, expected_joints, full_name, say, waiting
from sysid_node.ros.support.message_types import fields_of
from sysid_node.ros.support.silence import UNHEARD, ClockWatch, joined, namesakes, several_publishers
from sysid_node.ros.support.spin import run_node, while_ros_is_up

DIAGNOSTICS = 1.0  # s between diagnostics
TICK = 0.2  # s between checks of whether diagnostics are overdue because no estimate was published


class Identifier(CarefulNode):
    """``config/identifier.yaml`` explains its parameters; it starts by itself where ``autostart`` is true.

    Raises InputError on parameters of a wrong type or value, and SystemExit(2) where it cannot start by itself.
    """

    def __init__(self, make_session: Callable[[Aircraft, OnlineSettings, float], Session] = Session) -> None:
        """``make_session`` makes a session of the aircraft, the estimator's settings and the publication rate (Hz)."""
        super().__init__("identifier")
        self._make_session = make_session
        self._session: Session | None = None
        self._inputs: list[Any] = []  # subscriptions
        self._outputs: list[Any] = []  # lifecycle publishers
        declare(self, PARAMETERS, check)
        self.add_on_set_parameters_callback(self._on_parameters)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._clock_watch = ClockWatch(self)
        self._reported = -math.inf  # s, time.monotonic of the last diagnostics
        # A steady clock: diagnostics continue while simulated time stands still.
        self.create_timer(TICK, while_ros_is_up(self, self._on_tick), clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.create_service(Trigger, "~/reset", self.answered(self.reset))
        self.create_service(Trigger, "~/save", self.answered(self.save))
        if self.get_parameter("autostart").value:
            self._start()

    def _start(self) -> None:
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() != TransitionCallbackReturn.SUCCESS:
                raise SystemExit(2)

    # Lifecycle

    def configure(self) -> None:
        """Load the aircraft file; make the estimator, the subscriptions and the publishers."""
        values = values_of(self, PARAMETERS)
        aircraft = aircraft_of(self, values["aircraft"])
        self._session = self._make_session(aircraft, estimation_settings(values), values["publish_rate"])
        self._body_frame: BodyFrame = values["body_frame"]
        self._frame_id = ""
        self._lag = math.nan  # s, from the stamp of the last published sample to its publication
        self._publish_times = Durations()
        self._derivatives = self._publish_to(DerivativeEstimates, "~/derivatives", 10)
        self._model_gap = self._publish_to(ModelGap, "~/model_gap", 10)
        self._correlation = self._publish_to(EstimateCorrelation, "~/correlation", LAST_QOS)
        self._monitors = {topic: TopicMonitor(topic) for topic in (IMU, AIR_DATA, ACTUATORS)}
        self._recent, self._conditions = RecentCounts(), Conditions()
        self._joints: Text = ()  # the names of the last message about actuators
        self._carried = ""  # what was last said of the actuators' messages
        self._serialiser = EstimatesSerialiser(fields_of, aircraft.name, self._session.settings.method)
        self._listen(Imu, IMU, self._on_imu)
        self._listen(AirData, AIR_DATA, self._on_air_data)
        self._listen(JointState, ACTUATORS, self._on_actuators)
        self.get_logger().info(f"identifies {aircraft.name!r}: {', '.join(aircraft.model_structure)}")
        if not_taken := not_taken_in_words(aircraft):
            self.get_logger().warning(not_taken)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Listen; what came while the node did not is no silence."""
        for monitor in self._monitors.values():
            monitor.begin()
        return super().on_activate(state)

    def cleanup(self) -> None:
        """Destroy what ``configure`` made, even where it did not finish."""
        self._session = None
        while self._inputs:
            self.destroy_subscription(self._inputs.pop())
        while self._outputs:
            self.destroy_lifecycle_publisher(self._outputs.pop())

    def _publish_to(self, kind: Any, topic: str, profile: QoSProfile | int) -> Any:
        """A publisher that ``cleanup`` destroys."""
        publisher = self.create_lifecycle_publisher(kind, topic, profile)
        self._outputs.append(publisher)
        return publisher

    # Messages

    def _listen(self, kind: Any, topic: str, take: Callable[[Session, Numbers, Texts], list[Due]]) -> None:
        """Subscribe to an input topic, and publish the estimates that fall due after each message.

        Messages stay serialised: to make objects of all their parts would take longer than the estimator does.
        """
        monitor, paths = self._monitors[topic], messages.ATTITUDE_PATHS if topic == IMU else messages.PATHS[topic]
        reader = MessageReader(fields_of, INPUT_TOPICS[topic], *paths)

        def on_message(raw: bytes) -> None:
            monitor.arrived()
            if self._session is None:
                return
            try:
                numbers, texts = reader.read(raw)
            except DamageError:
                self._session.refuse(topic, UNREADABLE)
                return
            for due in take(self._session, numbers, texts):
                self._publish(self._session, due)
            if topic == IMU:  # others are often followed by one at once
                self._session.use_pause()

        overrides = QoSOverridingOptions.with_default_policies()
        subscription = self.create_subscription(
            kind, topic, self.guarded(on_message), SENSOR_QOS, qos_overriding_options=overrides, raw=True
        )
        monitor.resolved = subscription.topic_name
        self._inputs.append(subscription)

    def _on_imu(self, session: Session, numbers: Numbers, texts: Texts) -> list[Due]:
        self._frame_id = str(texts[0])
        return session.imu(*messages.imu_and_attitude(numbers, self._body_frame))

    def _on_air_data(self, session: Session, numbers: Numbers, texts: Texts) -> list[Due]:
        return session.air_data(*messages.air_data(numbers))

    def _on_actuators(self, session: Session, numbers: Numbers, texts: Texts) -> list[Due]:
        self._joints = texts[0]
        return session.actuators(*messages.actuators(numbers, texts))

    def _publish(self, session: Session, due: Due) -> None:
        start = time.perf_counter()
        self._derivatives.publish(self._serialiser.one(due.estimates, due.stamp_ns, self._frame_id))
        self._lag = (self.get_clock().now().nanoseconds - due.stamp_ns) / conversion.NANOSECONDS
        header = conversion.header(due.stamp_ns, self._frame_id)
        gaps, servos = session.gap(due), session.servo_gaps(due)
        self._model_gap.publish(conversion.gap_message(gaps, servos, header, session.aircraft.name))
        covariance = session.renewed_covariance()
        if covariance is not None:
            self._correlation.publish(conversion.correlation_message(covariance, header, session.aircraft.name))
        self._publish_times.add(time.perf_counter() - start)
        # Diagnostics follow an estimate at once, as no other estimate can be waiting then.
        if time.monotonic() - self._reported >= DIAGNOSTICS:
            self._report(due)

    # Requests

    def _on_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        state = self.state_label
        because = (
            ""
            if state == "unconfigured"
            else (f"when the node is configured; it is {state}: deactivate and clean it up first")
        )
        reason = refusal(self, PARAMETERS, LIVE, changes, check, because)
        return SetParametersResult(successful=not reason, reason=reason)

    def reset(self) -> str:
        """Forget all estimates. Raises InputError where the node is not configured."""
        if self._session is None:
            raise InputError(f"nothing to reset: the node is {self.state_label}")
        self._session.reset()
        return "all estimates forgotten"

    def save(self) -> str:
        """Write the estimates to a file and return its path. Raises InputError where there are none, or it fails."""
        if self._session is None or not self._session.samples:
            raise InputError(f"nothing to save: the node is {self.state_label} and no aligned sample has come")
        session, (stamp_ns, estimates, _) = self._session, self._session.now()
        path = save_estimates(
            Path(self.get_parameter("save_directory").value),
            estimates,
            node=full_name(self),
            aircraft=session.aircraft.name,
            settings=session.settings,
            stamp_ns=stamp_ns,
            samples=session.samples,
            rejected=session.rejected,
        )
        return str(path)

    # Diagnostics

    def _on_tick(self) -> None:
        self.settle()
        if time.monotonic() - self._reported >= DIAGNOSTICS + TICK:
            self._report()

    def _report(self, due: Due | None = None) -> None:
        """Publish diagnostics; ``due`` are the estimates of this moment, where they were just made."""
        self._reported = time.monotonic()
        source = DiagnosticSource(full_name(self), self._session.aircraft.name if self._session else "")
        message = DiagnosticArray(status=[source.state(self.state_label, self.fault, self.faults)])
        message.header.stamp = self.get_clock().now().to_msg()
        self.guarded(self._report_flight)(message, due)
        self._diagnostics.publish(message)

    def _report_flight(self, message: DiagnosticArray, due: Due | None) -> None:
        session = self._session
        if session is None:
            return
        source, stale_after = (
            DiagnosticSource(full_name(self), session.aircraft.name),
            self.get_parameter("stale_after").value,
        )
        monitors, rejected = list(self._monitors.values()), session.rejected
        recent = self._recent.update(monitors, rejected)
        due = due or (session.now(session.silence) if session.samples else None)
        wrong, doubts = session.faults, session.doubts(due)
        doubled = several_publishers(self, self._inputs) | namesakes(self, [self._derivatives])
        doubt = "; ".join([*doubts.values(), *(f"{topic}: {text}" for topic, text in doubled.items())])
        readings, max_gap = [*wrong.values()], session.settings.max_gap
        message.status.append(source.input(monitors, rejected, stale_after, recent, readings, max_gap, doubt))
        self._warn(session, monitors, recent, joined(wrong | doubts, doubled))
        if due is None:
            message.status += [source.waits("estimate"), source.waits("computation")]
            return
        self._say_what_actuators_carry(session.carried(due.estimates))
        silence = session.silence if session.silence > stale_after else 0.0
        if silence:
            lag = self._lag
            self._publish(session, due)  # without data no estimate falls due, but users must see that they are old
            self._lag = lag
        taken = "commands" if session.commanded else "positions"
        message.status.append(source.estimate(due.estimates, session.samples, self._lag, taken))
        work = {"update": session.update_times, "publication": self._publish_times}
        message.status.append(source.computation(work, self._lag, silence))

    def _say_what_actuators_carry(self, carried: str) -> None:
        """Say in the log what the actuators' messages are taken for, once, and again where that has changed."""
        if carried != self._carried:
            self._carried = carried
            self.get_logger().info(carried or "Actuators carry positions.")

    def _warn(
        self,
        session: Session,
        monitors: Sequence[TopicMonitor],
        recent: Sequence[RecentTopic],
        wrong: Mapping[str, str],
    ) -> None:
        """Say in the log which inputs are silent, rejected, late or ``wrong``, and what else is."""
        present = self._clock_watch.missing() | {
            monitor.resolved: waiting(self, monitor, subscription)
            for monitor, subscription in zip(monitors, self._inputs, strict=True)
            if monitor.waited() > UNHEARD
        }
        names = {monitor.name: monitor.resolved for monitor in monitors}
        present |= rejections([t for t in recent if t.troubled], names, session.settings.max_gap)
        joints, here = expected_joints(session.aircraft), self._monitors[ACTUATORS].resolved
        missing = [joint for joint in joints if joint not in self._joints]
        if missing and here in present and self._joints:
            present[here] += f"; expected joints {', '.join(joints)}, got {', '.join(self._joints)}"
        present = joined(present, wrong)
        if session.samples and lag_level(self._lag) != DiagnosticStatus.OK:
            present["estimates"] = lag_words(self._lag)
        say(self, self._conditions.update(present))


def main() -> None:
    """Entry point of the node."""
    sys.exit(run_node(Identifier, __doc__ or "", PARAMETERS))


if __name__ == "__main__":
    main()
