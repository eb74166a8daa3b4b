"""The node `fault_monitor`: reports which surface, sensor or part of the airframe failed, how much and since when."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData, DerivativeEstimates

from sysid_node.faults import watch as watching
from sysid_node.faults.model.blocks import MOST_GAP
from sysid_node.faults.model.reference_model import identifier_estimates
from sysid_node.faults.settings import RANGES, FaultMonitorSettings
from sysid_node.faults.types import Fault
from sysid_node.faults.watch import PERIOD, STALE_AFTER, Announcements
from sysid_node.flight.align import counts_by_reason
from sysid_node.flight.live import messages
from sysid_node.flight.live.messages import PATHS, Numbers, Texts
from sysid_node.flight.live.monitor import Durations
from sysid_node.flight.live.recent_counts import RecentCounts
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.parameter import AIRCRAFT, BODY_FRAME, NodeParameter, setting
from sysid_node.ros.support import conversion
from sysid_node.ros.support.diagnostics import rejections
from sysid_node.ros.support.loop_node import COMMAND, DERIVATIVES, LAG, SENSOR_QOS, LoopNode
from sysid_node.ros.support.silence import UNHEARD
from sysid_node.ros.support.spin import run_node

_DEFAULT = FaultMonitorSettings()
_setting = partial(setting, _DEFAULT, RANGES)

PARAMETERS = (
    AIRCRAFT,
    BODY_FRAME,
    _setting("false_alarms", "1/h", "False alarms that chance may make.", "Up to find smaller faults sooner."),
    _setting("learning", "s", "At the start, in which nothing is judged.", "Up where the flight begins roughly."),
    _setting("memory", "s", "Over which the residuals' colour is learned.", "Down where the air changes quickly."),
    _setting(
        "slack",
        "",
        "Share of each derivative that counts as no change: no model is exact.",
        "Up where the aircraft flies far from the condition at which its derivatives were identified.",
    ),
    _setting(*LAG),
    _setting(
        "servo_error",
        "rad",
        "Between a surface's measured position and where its command should have taken it.",
        "To what the servos do in sound flight.",
    ),
    NodeParameter(
        "stale_after",
        STALE_AFTER,
        "s",
        "A topic silent for longer is reported.",
        "Up where a sensor publishes more slowly than twice a second.",
        lower=0.01,
        upper=3600.0,
    ),
)

UNJUDGED = "faults"  # the subject of what is said where nothing is judged


class FaultMonitor(LoopNode):
    """``config/fault_monitor.yaml`` explains its parameters. Raises InputError on wrong ones."""

    def __init__(self) -> None:
        super().__init__("fault_monitor", PARAMETERS)
        settings = FaultMonitorSettings(**{name: self.values[name] for name in RANGES})
        self._watch = watching.init(self.aircraft, settings, self.values["stale_after"])
        self._work, self._speech, self._recent = Durations(), Announcements(), RecentCounts()
        self._since = time.monotonic()  # s, of the last complete sample, or of the last silence of a topic
        self._faults = self.create_publisher(DiagnosticArray, "~/faults", 10)
        self.listen(Imu, IMU, PATHS[IMU], self._on_imu, SENSOR_QOS)
        self.listen(AirData, AIR_DATA, PATHS[AIR_DATA], self._on_air_data, SENSOR_QOS)
        self.listen(JointState, ACTUATORS, PATHS[ACTUATORS], self._on_actuators, SENSOR_QOS)
        self.listen(JointState, COMMAND, PATHS[ACTUATORS], self._on_command, SENSOR_QOS, needed=False)
        self.hear(DerivativeEstimates, DERIVATIVES, self._on_estimates, 10, needed=False)
        self.every(PERIOD, self._on_time)

    def words(self) -> tuple[bytes, str, Mapping[str, object]]:
        """The present faults."""
        faults, judged = watching.present_faults(self._watch, time.monotonic()), self._watch.judged
        p50, p99 = self._work.percentiles()
        values: dict[str, object] = {"update p50 (us)": 1e6 * p50, "update p99 (us)": 1e6 * p99}
        values |= {"faults": len(faults), "judged for (s)": judged}
        wrong = [text if subject == UNJUDGED else f"{subject}: {text}" for subject, text in self.present.items()]
        if faults:
            return DiagnosticStatus.ERROR, "; ".join([*(fault.text for fault in faults), *wrong]), values
        sound = ["learns what sound flight is like" if judged <= 0.0 else "nothing has failed"]
        line = "; ".join([*([] if UNJUDGED in self.present else sound), *wrong])
        return DiagnosticStatus.WARN if wrong else DiagnosticStatus.OK, line, values

    def conditions(self) -> Mapping[str, str]:
        """The rejected messages; and that nothing is judged, where all topics come and no sample is complete."""
        names = {topic: self.inputs[topic].name for topic in (IMU, AIR_DATA, ACTUATORS)}
        rejected = counts_by_reason({names[topic]: of for topic, of in self._watch.alignment.rejected.items()})
        monitors = [self.inputs[topic] for topic in names]
        recent = self._recent.update(monitors, rejected)
        wrong = rejections([topic for topic in recent if topic.troubled], names, MOST_GAP, parameter="")
        now = time.monotonic()
        if any(monitor.waited() > UNHEARD for monitor in monitors):
            self._since = now
        late = now - self._since > UNHEARD
        return ({UNJUDGED: "nothing is judged: no complete sample comes"} if late else {}) | wrong

    # Messages

    def _on_imu(self, numbers: Numbers, _: Texts) -> None:
        self._take(watching.on_imu, *messages.imu(numbers, self.values["body_frame"]))

    def _on_air_data(self, numbers: Numbers, _: Texts) -> None:
        self._take(watching.on_air_data, *messages.air_data(numbers))

    def _on_actuators(self, numbers: Numbers, texts: Texts) -> None:
        self._take(watching.on_actuators, *messages.actuators(numbers, texts))

    def _take(self, take: Callable[..., None], *message: Any) -> None:
        """Pass a sensor's message on, and measure how long that takes."""
        start, before = time.monotonic(), self._watch.stamp_ns
        take(self._watch, start, *message)
        if self._watch.stamp_ns != before:
            self._since = start
        self._work.add(time.monotonic() - start)

    def _on_command(self, numbers: Numbers, texts: Texts) -> None:
        watching.on_command(self._watch, *messages.actuators(numbers, texts))

    def _on_estimates(self, message: Any) -> None:
        if not self.is_ours(message):
            return
        watching.on_estimates(self._watch, identifier_estimates(message.derivatives, message.servos))

    # Reports

    def _on_time(self) -> None:
        """Publish the faults: at once where they changed, else once a second."""
        now, before = time.monotonic(), self._speech.news
        faults = watching.present_faults(self._watch, now)
        if not self._speech.due(faults, now):
            return
        if self._speech.news != before:
            self.get_logger().warning("; ".join(fault.text for fault in faults) or "nothing is wrong any more")
        message = DiagnosticArray(status=[self._status(fault) for fault in faults])
        message.header = conversion.header(self._watch.stamp_ns, "")
        self._faults.publish(message)

    def _status(self, fault: Fault) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=DiagnosticStatus.ERROR,
            name=f"{self.get_name()}: {fault.part}",
            message=fault.text,
            hardware_id=self.aircraft.name,
            values=[KeyValue(key=key, value=value) for key, value in fault.values(self._watch.now).items()],
        )


def main() -> None:
    """Entry point of the node."""
    sys.exit(run_node(FaultMonitor, __doc__ or "", PARAMETERS))


if __name__ == "__main__":
    main()
