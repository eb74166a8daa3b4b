"""The node `exciter`: adds small deflections to the commands, on request, until the derivatives are known."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from sysid_msgs.msg import AirData, DerivativeEstimates

from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.errors import InputError
from sysid_node.excite import exciter
from sysid_node.excite.exciter import LimitedQuantities
from sysid_node.excite.exciter_settings import RANGES, ExcitationSettings
from sysid_node.excite.relative_precision import relative_precision
from sysid_node.faults.types import DAMAGE, HARD_OVER, LOSS, NOT_FOLLOWING, SHIFTED, STUCK
from sysid_node.flight.live import messages
from sysid_node.flight.live.flight_time import FlightTime
from sysid_node.flight.live.messages import ATTITUDE_PATHS, PATHS, Numbers, Texts
from sysid_node.flight.topics import AIR_DATA, EXCITATION, IMU
from sysid_node.parameter import AIRCRAFT, BODY_FRAME, NodeParameter, setting
from sysid_node.ros.support import conversion
from sysid_node.ros.support.loop_node import DERIVATIVES, LATEST, STANDING, LoopNode, named
from sysid_node.ros.support.spin import run_node

_DEFAULT = ExcitationSettings()
_setting = partial(setting, _DEFAULT, RANGES)

PARAMETERS = (
    AIRCRAFT,
    BODY_FRAME,
    NodeParameter(
        "manoeuvre",
        "+".join(_DEFAULT.manoeuvre),
        "",
        "What is flown, over and over: multisines, 3-2-1-1, doublets; several joined by + (docs: Manoeuvres).",
        "Amplitude up in rough air, down near the ground.",
    ),
    NodeParameter(
        "derivatives",
        " ".join(_DEFAULT.derivatives),
        "",
        "What is to be known, names with a space between.",
        "To those that you fly for.",
    ),
    NodeParameter(
        "watch",
        _DEFAULT.watch,
        "",
        "Whether it begins again by itself when one of them is no longer known, or a fault is reported.",
        "true beside an adaptive controller.",
    ),
    _setting(
        "accuracy",
        "",
        "Statistical part of half of an interval, over the derivative's size, with which it is known.",
        "As needed.",
    ),
    _setting("longest", "s", "It gives up after so long.", "Up in rough air."),
    _setting("largest_amplitude", "rad", "Largest deflection.", "To what the aircraft bears."),
    _setting("largest_roll", "rad", "Roll beyond which it aborts.", "For every aircraft."),
    _setting("largest_pitch", "rad", "Pitch beyond which it aborts.", "For every aircraft."),
    _setting("least_airspeed", "", "Airspeed below which it aborts, in the reference one.", "To well above the stall."),
    _setting("most_airspeed", "", "Airspeed above which it aborts, in the reference one.", "To below flutter."),
    _setting("least_load_factor", "", "Load factor below which it aborts.", "For every aircraft."),
    _setting("most_load_factor", "", "Load factor above which it aborts.", "For every aircraft."),
)
PERIOD = 0.01  # s between its messages
FAULTS = "fault_monitor/faults"
AIRCRAFT_FAULTS = frozenset({LOSS, STUCK, HARD_OVER, SHIFTED, NOT_FOLLOWING, DAMAGE})
STALE = 0.2  # s without a sensor's message, after which the manoeuvre is aborted


class Exciter(LoopNode):
    """``config/exciter.yaml`` explains its parameters. Raises InputError on wrong ones."""

    def __init__(self) -> None:
        super().__init__("exciter", PARAMETERS)
        settings = {name: self.values[name] for name in ("watch", *RANGES)}
        settings |= {name: tuple(self.values[name].split()) for name in ("derivatives", "manoeuvre")}
        self._state = exciter.init(self.aircraft, ExcitationSettings(**settings))
        self._inertial, self._air = (-math.inf, (math.nan,) * 3), (-math.inf, math.nan)
        self._logged = 0
        self._time = FlightTime()  # by the IMU's stamps
        self._excitation = self.create_publisher(JointState, EXCITATION, 10)
        self._reset = self.create_client(Trigger, "identifier/reset")
        self.listen(Imu, IMU, ATTITUDE_PATHS, self._on_imu, LATEST)
        self.listen(AirData, AIR_DATA, PATHS[AIR_DATA], self._on_air_data, LATEST)
        self.hear(DerivativeEstimates, DERIVATIVES, self._on_estimates, 10)
        self.hear(DiagnosticArray, FAULTS, self._on_faults, 10, needed=False)
        self.create_service(Trigger, "~/start", self._on_start)
        self.create_service(Trigger, "~/stop", self._on_stop)
        self.every(PERIOD, self._on_time)

    @property
    def _now(self) -> float:
        """The time of flight, s."""
        return self._time.seconds

    def words(self) -> tuple[bytes, str, Mapping[str, object]]:
        """Whether it excites, and its last event."""
        state = self._state
        last = state.events[-1].text if state.events else "nothing flown yet"
        doing = f"exciting for {self._now - state.begun:.1f} s" if state.active else last
        values = {
            "active": state.active,
            "not yet known": " ".join(state.estimates.missing),
            "events": state.happened,
        }
        line = "; ".join([doing, *(f"{subject}: {text}" for subject, text in self.present.items())])
        level = DiagnosticStatus.WARN if self.present else DiagnosticStatus.OK
        return level, line, {**values, "last event": last}

    def conditions(self) -> Mapping[str, str]:
        """That messages of the IMU are left out because none is newer than those before it."""
        imu = self.inputs[IMU]
        stand = imu.received and imu.waited() <= STALE < time.monotonic() - self._inertial[0]
        return {imu.name: STANDING} if stand else {}

    def _on_imu(self, numbers: Numbers, _: Texts) -> None:
        stamp, values, attitude = messages.imu_and_attitude(numbers, self.values["body_frame"])
        if self._time.arrived(stamp):
            self._inertial = time.monotonic(), (*attitude, -values[2] / GRAVITY)

    def _on_air_data(self, numbers: Numbers, _: Texts) -> None:
        self._air = time.monotonic(), messages.air_data(numbers)[1][0]

    def _on_estimates(self, message: Any) -> None:
        if not self.is_ours(message):
            return
        estimates = conversion.estimates_from_message(message, 0)
        known = {n: d for n, d in estimates.derivatives.items() if n in self.aircraft.derivatives}
        precision = relative_precision(known.values(), self.aircraft)
        if exciter.receive_estimates(self._state, self._now, precision):
            self._reset_estimates()
        self._log_events()

    def _reset_estimates(self) -> None:
        """Ask the identifier to begin anew, and say so where nobody can be asked."""
        if self._reset.service_is_ready():
            self._reset.call_async(Trigger.Request())
        else:
            name = self.resolve_service_name("identifier/reset")
            self.get_logger().warning(f"{name}: nobody offers this service; old estimates go on beside the new flight")

    def _on_faults(self, message: Any) -> None:
        """Faults of surfaces and of the airframe; those of sensors are no reason to move the surfaces."""
        named = [{pair.key: pair.value for pair in status.values} for status in message.status]
        kinds = {f"{one.get('part')}: {one.get('kind')}" for one in named if one.get("kind") in AIRCRAFT_FAULTS}
        exciter.receive_faults(self._state, self._now, kinds)
        self._log_events()

    def _on_time(self) -> None:
        moved = exciter.step(self._state, self._now, self._limited())
        stamp = self.get_clock().now().nanoseconds
        self._excitation.publish(named(stamp, dict(zip(self.aircraft.controls, moved.tolist(), strict=True))))
        self._log_events()

    def _limited(self) -> LimitedQuantities:
        """The quantities that have limits, NaN where the sensor's last message is old."""
        now = time.monotonic()
        (imu_time, (roll, pitch, load)), (air_time, airspeed) = self._inertial, self._air
        if now - imu_time > STALE:
            roll = pitch = load = math.nan
        if now - air_time > STALE:
            airspeed = math.nan
        return LimitedQuantities(roll, pitch, airspeed, load)

    def _on_start(self, _: Any, response: Any) -> Any:
        try:
            imu = self.inputs[IMU]
            if not imu.received:
                raise InputError(f"{imu.name}: no message yet; excitation needs the attitude and the load factor")
            exciter.start(self._state, self._now, self._limited())
            until = f"until {', '.join(self._state.settings.derivatives)} are known"
            response.success, response.message = True, f"{until}{self._unheard()}"
        except InputError as error:
            response.success, response.message = False, str(error)
        return response

    def _unheard(self) -> str:
        """That no surface will move, which the log says too; empty where somebody listens."""
        if self._excitation.get_subscription_count():
            return ""
        words = f"nobody listens to {self._excitation.topic_name}, so no surface will move"
        self.get_logger().warning(words)
        return f"; {words}"

    def _on_stop(self, _: Any, response: Any) -> Any:
        exciter.stop(self._state, self._now, "stopped on request")
        response.success, response.message = True, "surfaces are in the middle"
        return response

    def _log_events(self) -> None:
        """Log the events since the last call."""
        news = self._state.happened - self._logged
        for event in self._state.events[len(self._state.events) - news :]:
            self.get_logger().info(event.text)
        self._logged = self._state.happened


def main() -> None:
    """Entry point of the node."""
    sys.exit(run_node(Exciter, __doc__ or "", PARAMETERS))


if __name__ == "__main__":
    main()
