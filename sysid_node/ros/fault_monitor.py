"""The node `fault_monitor`: says which surface, sensor or part of the airframe has failed, how much and since when."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData, DerivativeEstimates

from sysid_node.faults import blocks, monitor, servos
from sysid_node.faults.held import Known
from sysid_node.faults.settings import RANGES, Settings
from sysid_node.faults.types import SILENT, Fault
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.online import intake
from sysid_node.ros import conversion
from sysid_node.ros.conversion import NANOSECONDS, stamp_ns
from sysid_node.ros.loop_node import AIRCRAFT, COMMAND, DERIVATIVES, SENSOR_QOS, LoopNode
from sysid_node.ros.monitor import Durations, TopicMonitor
from sysid_node.ros.parameters import Parameter, setting
from sysid_node.ros.spin import run_program, serve

_DEFAULT = Settings()
_setting = partial(setting, _DEFAULT, RANGES)

PARAMETERS = (
    AIRCRAFT,
    _setting("false_alarms", "1/h", "False alarms that chance may make.", "Up to find smaller faults sooner."),
    _setting("learning", "s", "At the start, in which nothing is judged.", "Up where the flight begins roughly."),
    _setting("memory", "s", "Over which the residuals' colour is learned.", "Down where the air changes quickly."),
    _setting(
        "slack",
        "",
        "Share of each derivative that counts as no change: no model is exact.",
        "Up where the aircraft flies far from the condition at which its derivatives were identified.",
    ),
    _setting("actuator_lag", "s", "First-order lag of the surfaces behind their commands.", "For every aircraft."),
    _setting(
        "servo_error",
        "rad",
        "Between a surface's measured position and where its command should have taken it.",
        "To what the servos do in sound flight.",
    ),
    Parameter(
        "stale_after",
        0.5,
        "s",
        "A topic silent for longer is reported.",
        "Up where a sensor publishes more slowly than twice a second.",
        lower=0.01,
        upper=3600.0,
    ),
)
PERIOD = 0.1  # s between looks at what is to be said
REPEATED = 1.0  # s after which the same is said again


class FaultMonitor(LoopNode):
    """``config/fault_monitor.yaml`` says what its parameters mean. Raises InputError on wrong ones."""

    def __init__(self) -> None:
        super().__init__("fault_monitor", PARAMETERS)
        settings = Settings(**{name: self.values[name] for name in RANGES})
        self._intake = intake.init(self.aircraft, blocks.MOST_GAP)
        self._state, self._servos = monitor.init(self.aircraft, settings), servos.init(self.aircraft, settings)
        self._actuation = Actuation.of(self.aircraft)
        self._servo_faults: list[Fault] = []
        self._start_ns, self._now, self._moved = 0, 0.0, -math.inf  # ns; s of the samples; s of the positions
        self._work, self._said, self._said_at = Durations(), "", -math.inf
        self._topics = {topic: TopicMonitor(topic) for topic in (IMU, AIR_DATA, ACTUATORS)}
        self._faults = self.create_publisher(DiagnosticArray, "~/faults", 10)
        self.create_subscription(Imu, IMU, self._on_imu, SENSOR_QOS)
        self.create_subscription(AirData, AIR_DATA, self._on_air_data, SENSOR_QOS)
        self.create_subscription(JointState, ACTUATORS, self._on_actuators, SENSOR_QOS)
        self.create_subscription(JointState, COMMAND, self._on_command, SENSOR_QOS)
        self.create_subscription(DerivativeEstimates, DERIVATIVES, self._on_estimates, 10)
        self.every(PERIOD, self._on_time)

    def words(self) -> tuple[bytes, str, Mapping[str, object]]:
        """What is wrong."""
        faults = self._wrong()
        p50, p99 = self._work.percentiles()
        values: dict[str, object] = {"update p50 (us)": 1e6 * p50, "update p99 (us)": 1e6 * p99}
        values |= {"faults": len(faults), "judged for (s)": self._judged()}
        if faults:
            return DiagnosticStatus.ERROR, "; ".join(fault.text for fault in faults), values
        learning = self._judged() <= 0.0
        return DiagnosticStatus.OK, "learns what sound flight is like" if learning else "nothing has failed", values

    def _judged(self) -> float:
        """Seconds of flight that were judged."""
        return max(0.0, self._state.count * blocks.PERIOD - self._state.settings.learning)

    def _wrong(self) -> list[Fault]:
        """All faults at present."""
        silent = [
            Fault(SILENT, t.name, t.silence(), math.nan, math.nan, "s", self._now - t.silence(), self._now, 1.0)
            for t in self._topics.values()
            if t.silence() > self.values["stale_after"]
        ]
        forces = [self._state.fault] if self._state.fault and not silent else []
        return [*silent, *self._servo_faults, *forces]

    # Messages

    def _on_imu(self, message: Any) -> None:
        self._topics[IMU].arrived()
        stamp = stamp_ns(message.header.stamp)
        self._start_ns = self._start_ns or stamp
        self._take(intake.on_imu(self._intake, stamp, conversion.imu_values(message, -1.0)))

    def _on_air_data(self, message: Any) -> None:
        self._topics[AIR_DATA].arrived()
        values = conversion.air_data_values(message)
        self._take(intake.on_air_data(self._intake, stamp_ns(message.header.stamp), values))

    def _on_actuators(self, message: Any) -> None:
        self._topics[ACTUATORS].arrived()
        stamp = stamp_ns(message.header.stamp)
        self._moved = stamp / NANOSECONDS
        controls = self._controls(message)
        if controls:
            self._servo_faults = servos.position(self._servos, self._moved, controls)
        self._take(intake.on_actuators(self._intake, stamp, message.name, message.position))

    def _on_command(self, message: Any) -> None:
        controls = self._controls(message)
        if controls:
            stamp = stamp_ns(message.header.stamp) / NANOSECONDS
            servos.command(self._servos, stamp or self._moved, controls)

    def _on_estimates(self, message: Any) -> None:
        known = {d.name: Known(d.value, d.standard_error, d.valid) for d in message.derivatives}
        monitor.hear(self._state, self._now, known)

    def _controls(self, message: Any) -> tuple[float, ...]:
        """Controls (rad) of joint positions; empty where they are no such."""
        found = self._actuation.of_message(self._actuation.places(message.name), message.position)
        return () if isinstance(found, str) else found[1:]

    def _take(self, samples: Sequence[tuple[float, Sequence[float]]]) -> None:
        for moment, sample in samples:
            start = time.perf_counter()
            self._now = moment
            monitor.update(self._state, moment, sample)
            self._work.add(time.perf_counter() - start)

    # What is said

    def _on_time(self) -> None:
        """Say what is wrong, at once where it is news."""
        faults = self._wrong()
        news = " ".join(f"{fault.part} {fault.kind}" for fault in faults)
        if news == self._said and time.monotonic() - self._said_at < REPEATED:
            return
        if news != self._said:
            self.get_logger().warning("; ".join(fault.text for fault in faults) or "nothing is wrong any more")
        self._said, self._said_at = news, time.monotonic()
        message = DiagnosticArray(status=[self._status(fault) for fault in faults])
        message.header = conversion.header(self._stamp(self._now), "")
        self._faults.publish(message)

    def _stamp(self, moment: float) -> int:
        """ns of a sample's time (s)."""
        return self._start_ns + round(NANOSECONDS * moment)

    def _status(self, fault: Fault) -> DiagnosticStatus:
        values: dict[str, object] = {"kind": fault.kind, "part": fault.part, "size": fault.size}
        values |= {"lower": fault.lower, "upper": fault.upper, "unit": fault.unit, "probability": fault.probability}
        values |= {"since (s)": fault.since, "found (s)": fault.found, "now (s)": self._now}
        values |= {c.name: f"{c.value:.6g} [{c.lower:.6g}, {c.upper:.6g}]" for c in fault.changes}
        pairs = [KeyValue(key=k, value=f"{v:.6g}" if isinstance(v, float) else str(v)) for k, v in values.items()]
        return DiagnosticStatus(
            level=DiagnosticStatus.ERROR,
            name=f"{self.get_name()}: {fault.part}",
            message=fault.text,
            hardware_id=self.aircraft.name,
            values=pairs,
        )


def main() -> None:
    """Entry point of the node."""
    sys.exit(run_program(lambda: serve(FaultMonitor())))


if __name__ == "__main__":
    main()
