"""The node `adaptive_controller`: flies set-points, with gains that follow the identified derivatives."""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData, DerivativeEstimates, EstimateCorrelation

from sysid_node.control import controller
from sysid_node.control.design.plant import CONTROLS
from sysid_node.control.inputs.estimates import identified_derivatives
from sysid_node.control.inputs.set_point_input import SetPointInput
from sysid_node.control.law.allocation import Allocation
from sysid_node.control.law.reference import set_point_limits
from sysid_node.control.settings import RANGES, ControllerSettings
from sysid_node.control.types import Command, Measurements
from sysid_node.flight.live import messages
from sysid_node.flight.live.arrivals import Arrivals
from sysid_node.flight.live.messages import ATTITUDE_PATHS, PATHS, Numbers, Texts
from sysid_node.flight.live.monitor import Durations
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, EXCITATION, IMU
from sysid_node.parameter import AIRCRAFT, BODY_FRAME, NodeParameter, setting
from sysid_node.ros.support import conversion
from sysid_node.ros.support.conversion import NANOSECONDS, stamp_ns
from sysid_node.ros.support.loop_node import (
    COMMAND,
    CORRELATION,
    DERIVATIVES,
    LAG,
    LAST_QOS,
    LATEST,
    SET_POINT_QOS,
    SET_POINTS,
    STANDING,
    LoopNode,
    by_name,
    named,
)
from sysid_node.ros.support.spin import run_node

_DEFAULT = ControllerSettings()
_setting = partial(setting, _DEFAULT, RANGES)

PARAMETERS = (
    AIRCRAFT,
    BODY_FRAME,
    NodeParameter(
        "adapt",
        True,
        "",
        "Whether estimates are used; false: the gains of the aircraft file, whatever is identified.",
        "false to compare, or until the identifier is trusted.",
    ),
    _setting(*LAG),
    _setting("delay", "s", "From a reading to its command's arrival at the actuator.", "Up on a slow bus."),
    _setting(
        "gain_margin",
        "",
        "Factor by which every loop's gain may grow or fall, whatever is true within the intervals (2 = 6 dB).",
        "Up for more caution.",
    ),
    _setting(
        "phase_margin",
        "rad",
        "Phase that every loop has left, whatever is true within the intervals.",
        "Up for more caution.",
    ),
    _setting(
        "tightness",
        "",
        "Half of an interval over the derivative's size, beyond which the estimate is not used.",
        "Down to use only what is known well.",
    ),
    _setting(
        "explained",
        "",
        "Share of a coefficient's motion that the model must explain, for its derivatives to be used.",
        "Down in rough air, at the risk of biased estimates.",
    ),
    _setting("gain_rate", "1/s", "How fast gains move, in baseline gains a second.", "Down for smoother transitions."),
    _setting("stale_after", "s", "Without estimates for so long, the baseline is flown.", "Up for a slow identifier."),
    _setting("command_rate", "rad/s", "Fastest movement of a surface's command.", "To what the servos can do."),
    _setting(
        "command_limit", "rad", "Largest command where the aircraft file gives no limit.", "To the surfaces' travel."
    ),
    _setting("bandwidth", "rad/s", "Of the attitude that is asked of the aircraft.", "Down for a sluggish aircraft."),
    _setting("largest_roll", "rad", "Largest roll set-point.", "Up for aerobatics."),
    _setting("largest_pitch", "rad", "Largest pitch set-point.", "Up for aerobatics."),
    _setting("largest_sideslip", "rad", "Largest sideslip set-point.", "Up for crosswind landings."),
    _setting(
        "largest_excitation",
        "rad",
        "Largest excitation of a surface; more is clipped.",
        "Up together with the exciter's largest_amplitude.",
    ),
    _setting(
        "largest_tracking_error",
        "rad",
        "Of pitch or roll; beyond it the baseline is flown until the error was small for 5 s.",
        "Up for aerobatics.",
    ),
    _setting(
        "set_points_expire_after",
        "s",
        "Without set-points for so long, level flight is flown.",
        "Up where set-points come rarely.",
    ),
)
SENSOR_AGE = 0.5  # s: older air data count as not measured
IMU_AGE = 0.1  # s without an IMU message, after which the surfaces return to their positions in level flight
EXCITATION_AGE = 0.1  # s without an excitation message, after which excitation is taken to have ended
AGES = {AIR_DATA: SENSOR_AGE, DERIVATIVES: 1.0, EXCITATION: 0.5}  # s of silence that are reported


class AdaptiveController(LoopNode):
    """``config/adaptive_controller.yaml`` explains its parameters. Raises InputError on wrong ones."""

    def __init__(self) -> None:
        super().__init__("adaptive_controller", PARAMETERS)
        settings = ControllerSettings.from_mapping(self.values)
        self._state = controller.init(self.aircraft, settings)
        self._allocation = Allocation.of(self.aircraft)
        self._points = SetPointInput(
            settings.set_points_expire_after, set_point_limits(self.aircraft.reference.airspeed, settings)
        )
        self._air: tuple[float, tuple[float, ...]] = (-math.inf, (math.nan,) * 4)  # time, values
        self._extra: tuple[float, list[float]] = (-math.inf, [0.0] * len(CONTROLS))
        self._now, self._imu_count, self._steps_without_imu = math.nan, 0, 0
        self._start_ns = 0
        self._work = Durations()
        self._checked = Counter[str]()  # what the controller's checks had counted at the last report
        self._wrong: dict[str, str] = {}  # what was wrong with set-points and estimates since the last report
        self._steps, self._steps_at_limit = 0, np.zeros(len(CONTROLS), int)  # since the last report
        self._command = self.create_publisher(JointState, COMMAND, 10)
        self._tracking = self.create_publisher(JointState, "~/tracking", 10)
        self.listen(Imu, IMU, ATTITUDE_PATHS, self._on_imu, LATEST)
        self.listen(AirData, AIR_DATA, PATHS[AIR_DATA], self._on_air_data, LATEST)
        self.hear(DerivativeEstimates, DERIVATIVES, self._on_estimates, 10, needed=self.values["adapt"])
        self.hear(EstimateCorrelation, CORRELATION, self._on_correlation, LAST_QOS, needed=False)
        self.listen(JointState, EXCITATION, PATHS[ACTUATORS], self._on_excitation, LATEST, needed=False)
        self.listen(JointState, SET_POINTS, PATHS[ACTUATORS], self._on_set_points, SET_POINT_QOS, needed=False)
        self._imu = Arrivals(self.inputs[IMU].name, IMU_AGE)
        self._others = {topic: Arrivals(self.inputs[topic].name, age) for topic, age in AGES.items()}
        self.every(0.02, self._watch)

    def words(self) -> tuple[bytes, str, Mapping[str, object]]:
        """Which gains each axis flies and why, and problems with the topics."""
        p50, p99 = self._work.percentiles()
        values: dict[str, object] = {"step p50 (us)": 1e6 * p50, "step p99 (us)": 1e6 * p99}
        values |= {"commands without an IMU": self._steps_without_imu, "IMU messages": self._imu_count}
        arrivals = (self._imu, *self._others.values())
        values |= {f"{one.topic}: troubles so far": one.count for one in arrivals}
        troubles = [words for one in arrivals for words in one.troubles()]
        for axis in self._state.axes:
            values[f"{axis.axis.name}: gains"] = axis.verdict
            values[f"{axis.axis.name}: estimates used"] = " ".join(axis.used)
            values[f"{axis.axis.name}: checks passed"] = axis.accepted
            values[f"{axis.axis.name}: checks failed"] = axis.refused
        values |= {f"inputs: {what}": count for what, count in self._state.checks.counts.items()}
        line = "; ".join(f"{axis.axis.name}: {axis.verdict}" for axis in self._state.axes)
        if self._imu.silent() or not self._imu_count:
            silent = f": {STANDING}" if self._stamps_stand() else " silent"
            return DiagnosticStatus.ERROR, f"{self._imu.topic}{silent}: surfaces at level flight's; {line}", values
        troubles += [f"{subject}: {text}" for subject, text in self.present.items()]
        line = "; ".join([line, *troubles])
        return DiagnosticStatus.WARN if self._state.stale or troubles else DiagnosticStatus.OK, line, values

    def conditions(self) -> Mapping[str, str]:
        """What arrived and was left out or clipped, surfaces at their limits, and a large tracking error."""
        present, self._wrong = self._wrong, {}
        if self._stamps_stand():
            present[self._imu.topic] = f"{STANDING}: surfaces at level flight's"
        present |= self._foreign_stamps()
        counts, before = self._state.checks.counts, self._checked
        present |= {f"input {what}": f"{n - before[what]} times" for what, n in counts.items() if n > before[what]}
        self._checked = Counter(counts)
        for name, steps, limit in zip(
            CONTROLS, self._steps_at_limit.tolist(), self._state.law.design.limits, strict=True
        ):
            if 2 * steps > self._steps:
                present[name] = f"at its limit of {limit:g} rad"
        self._steps, self._steps_at_limit = 0, np.zeros(len(CONTROLS), int)
        if self._state.tracking.words:
            present["tracking"] = self._state.tracking.words
        if self._points.expired(time.monotonic()):
            expired = f"none for {self.values['set_points_expire_after']:g} s: level flight is flown"
            present["set-points"] = expired
        return present

    def states(self) -> Mapping[str, str]:
        """The gains that are flown, and why."""
        return {f"{axis.axis.name} gains": axis.verdict for axis in self._state.axes}

    def _on_imu(self, numbers: Numbers, _: Texts) -> None:
        stamp, (_x, _y, _z, p, q, r), (phi, theta) = messages.imu_and_attitude(numbers, self.values["body_frame"])
        self._start_ns = self._start_ns or stamp
        now = (stamp - self._start_ns) / NANOSECONDS
        if not self._imu.arrived(now):
            return  # out of order
        self._now = now
        self._imu_count += 1
        taken, air = self._air
        V, alpha, beta, density = air if abs(now - taken) <= SENSOR_AGE else (math.nan,) * 4
        self._fly(Measurements(now, p, q, r, phi, theta, V, alpha, beta, density))

    def _on_air_data(self, numbers: Numbers, _: Texts) -> None:
        stamp, values = messages.air_data(numbers)
        self._others[AIR_DATA].arrived(stamp / NANOSECONDS)
        self._air = (stamp - self._start_ns) / NANOSECONDS, values

    def _on_estimates(self, message: Any) -> None:
        if not self.is_ours(message):
            return
        estimates = conversion.estimates_from_message(message, self._start_ns)
        self._others[DERIVATIVES].arrived(stamp_ns(message.header.stamp) / NANOSECONDS)
        controller.receive_estimates(self._state, estimates.time, identified_derivatives(estimates))

    def _on_correlation(self, message: Any) -> None:
        if message.aircraft == self.aircraft.name:
            correlation = conversion.correlation_from_message(message, self.aircraft.derivatives)
            controller.receive_correlation(self._state, correlation)

    def _on_excitation(self, numbers: Numbers, texts: Texts) -> None:
        stamp, values = by_name(numbers, texts)
        self._others[EXCITATION].arrived(stamp / NANOSECONDS)
        self._extra = time.monotonic(), [values.get(name, 0.0) for name in CONTROLS]

    def _on_set_points(self, numbers: Numbers, texts: Texts) -> None:
        _stamp, values = by_name(numbers, texts)
        wrong = self._points.receive(time.monotonic(), values)
        if wrong:
            self._wrong[self.inputs[SET_POINTS].name] = "; ".join(wrong)

    def _foreign_stamps(self) -> dict[str, str]:
        """The topic of the air data with what is wrong with it, where it comes and counts as too old for its stamps."""
        air = self.inputs[AIR_DATA]
        if self._imu.silent() or not air.received or air.waited() > SENSOR_AGE:
            return {}
        ahead = self._others[AIR_DATA].stamp - self._start_ns / NANOSECONDS - self._now
        if not abs(ahead) > SENSOR_AGE:
            return {}
        words = f"stamped {abs(ahead):.3g} s {'after' if ahead > 0.0 else 'before'} {self._imu.topic}"
        return {air.name: f"{words}: counts as not measured"}

    def _stamps_stand(self) -> bool:
        """Whether the IMU counts as silent although messages come: none is newer than those before it."""
        return self._imu.silent() and self.inputs[IMU].waited() <= IMU_AGE

    def _watch(self) -> None:
        """Without an IMU: no feedback, and the surfaces return to their positions in level flight."""
        if self._imu.silent():
            silence = time.monotonic() - self._imu.last_arrival
            self._steps_without_imu += 1
            self._fly(Measurements(self._now + silence, *(math.nan,) * (len(Measurements._fields) - 1)))

    def _fly(self, sensed: Measurements) -> None:
        start = time.perf_counter()
        received, extra = self._extra
        excitation = extra if time.monotonic() - received < EXCITATION_AGE else controller.NO_EXCITATION
        command = controller.step(self._state, sensed, self._points.current(time.monotonic()), excitation)
        self._steps, self._steps_at_limit = self._steps + 1, self._steps_at_limit + self._state.law.surfaces.at_limit
        stamp = self._start_ns + round(NANOSECONDS * sensed.time)
        self._command.publish(named(stamp, self._joints(command)))
        self._tracking.publish(named(stamp, self._errors(sensed)))
        self._work.add(time.perf_counter() - start)

    def _errors(self, sensed: Measurements) -> dict[str, float]:
        """The reference motion, and how far the aircraft is from it, rad."""
        wanted = self._state.law.wanted
        if wanted is None:
            return {}
        return {
            "pitch": wanted.theta,
            "roll": wanted.phi,
            "sideslip": wanted.beta,
            "pitch error": sensed.theta - wanted.theta,
            "roll error": sensed.phi - wanted.phi,
            "sideslip error": sensed.beta - wanted.beta,
        }

    def _joints(self, command: Command) -> dict[str, float]:
        """Joint positions of a command."""
        by_name = dict(zip(CONTROLS, command, strict=False))
        controls = [by_name.get(name, 0.0) for name in self.aircraft.controls]
        positions = self._allocation.positions(controls, command.thrust)
        return dict(zip(self._allocation.joints, positions, strict=True))


def main() -> None:
    """Entry point of the node."""
    sys.exit(run_node(AdaptiveController, __doc__ or "", PARAMETERS))


if __name__ == "__main__":
    main()
