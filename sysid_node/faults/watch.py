"""The complete fault monitor, from messages to the present faults: by forces, servos and silent topics.

    watch = init(aircraft, FaultMonitorSettings(), stale_after=0.5)
    on_imu(watch, arrived, stamp_ns, values)            # and so on, for every message in the order of arrival
    faults = present_faults(watch, now)

The live node and the replay of a recording call these functions. ``arrived`` and ``now`` are s of one clock that never
jumps, the node's or the recorder's. A fault's times are those of the samples: s since the first IMU message.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.stated_effects import as_estimated
from sysid_node.faults import monitor
from sysid_node.faults.hypotheses import rate_limits, servo_times
from sysid_node.faults.hypotheses import servo_check as servos
from sysid_node.faults.hypotheses.rate_limits import RateLimits
from sysid_node.faults.hypotheses.servo_check import ServoCheckState
from sysid_node.faults.hypotheses.servo_times import ServoTimes
from sysid_node.faults.model import blocks
from sysid_node.faults.model.reference_model import IdentifierEstimates
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.state import MonitorState
from sysid_node.faults.types import ARRIVAL, SILENT, SLOWER, Fault
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.online.alignment import streaming
from sysid_node.online.alignment.streaming import AlignedSample, AlignmentState

PERIOD = 0.1  # s between checks whether to report
REPEATED = 1.0  # s after which the same faults are reported again
STALE_AFTER = 0.5  # s without a message, after which a topic is silent, by default
_SECOND = 1e9  # ns


@dataclass
class MessageWatch:
    """The state of the complete monitor."""

    state: MonitorState
    servos: ServoCheckState
    alignment: AlignmentState
    limits: RateLimits
    stale_after: float  # s
    now: float = 0.0  # s, of the last sample
    stamp_ns: int = 0  # header stamp of the last sample
    heard: dict[str, tuple[float, float]] = field(default_factory=dict)  # by topic: arrival (s), ``now`` then
    moved: float = math.nan  # s, time of the last positions
    off_command: list[Fault] = field(default_factory=list)  # of surfaces that are not where they were commanded
    servo_times: ServoTimes = field(default_factory=ServoTimes)

    @property
    def judged(self) -> float:
        """Seconds of flight that were checked for faults."""
        return max(0.0, monitor.learned(self.state) - self.state.settings.learning)


def init(aircraft: Aircraft, settings: FaultMonitorSettings, stale_after: float) -> MessageWatch:
    """A monitor before the first message. A topic that falls silent for ``stale_after`` s is a fault."""
    aircraft = as_estimated(aircraft)
    taken = streaming.init(aircraft, blocks.MOST_GAP)
    forces, positions = monitor.init(aircraft, settings), servos.init(aircraft, settings)
    limits = rate_limits.init(aircraft, forces.terms)
    return MessageWatch(forces, positions, taken, limits, stale_after)


def on_imu(watch: MessageWatch, arrived: float, stamp_ns: int, values: tuple[float, ...]) -> None:
    """Take an IMU message: specific force (m/s^2) and rates (rad/s), FRD."""
    watch.heard[IMU] = (arrived, watch.now)
    _take(watch, streaming.on_imu(watch.alignment, stamp_ns, values))


def on_air_data(watch: MessageWatch, arrived: float, stamp_ns: int, values: tuple[float, ...]) -> None:
    """Take an air data message: true airspeed (m/s), flow angles (rad), air density (kg/m^3)."""
    watch.heard[AIR_DATA] = (arrived, watch.now)
    _take(watch, streaming.on_air_data(watch.alignment, stamp_ns, values))


def on_actuators(
    watch: MessageWatch, arrived: float, stamp_ns: int, names: Sequence[str], positions: Sequence[float]
) -> None:
    """Take joint positions: rad, throttle 0..1 or N."""
    watch.heard[ACTUATORS] = (arrived, watch.now)
    controls = _controls(watch.alignment.actuation, names, positions)
    if controls and watch.alignment.imu.bases:
        watch.moved = _time_of(watch.alignment, stamp_ns)
        watch.off_command = servos.position(watch.servos, watch.moved, controls)
    _take(watch, streaming.on_actuators(watch.alignment, stamp_ns, names, positions))


def on_command(watch: MessageWatch, stamp_ns: int, names: Sequence[str], positions: Sequence[float]) -> None:
    """Take a command to the joints; without a stamp, it has the time of the last positions."""
    controls = _controls(watch.alignment.actuation, names, positions)
    moment = _time_of(watch.alignment, stamp_ns) if stamp_ns and watch.alignment.imu.bases else watch.moved
    if controls and math.isfinite(moment):
        servos.command(watch.servos, moment, controls)


def on_estimates(watch: MessageWatch, known: IdentifierEstimates) -> None:
    """Take the identifier's estimates of the last sample."""
    monitor.receive_estimates(watch.state, watch.now, known)
    servo_times.receive(watch.servo_times, watch.now, known.servos, known.changed)


def present_faults(watch: MessageWatch, now: float) -> list[Fault]:
    """All faults at a time (s, by the arrivals' clock).

    One that was found by the forces stands while a topic is silent: nothing contradicts it then.
    """
    silent = [
        Fault(
            SILENT,
            topic,
            now - arrived,
            *(math.nan, math.nan, "s"),
            since=since,
            found=since + watch.stale_after,
            probability=1.0,
            source=ARRIVAL,
        )
        for topic in (IMU, AIR_DATA, ACTUATORS)
        for arrived, since in [watch.heard.get(topic, (math.inf, 0.0))]
        if now - arrived > watch.stale_after
    ]
    forces = [watch.state.fault] if watch.state.fault else []
    slower = {fault.part for fault in forces if fault.kind == SLOWER}
    estimated = [fault for fault in watch.servo_times.faults if fault.part not in slower]
    return [*silent, *watch.off_command, *estimated, *watch.limits.faults, *forces]


@dataclass
class Announcements:
    """Decides when faults are reported: when they change, and once a second."""

    news: str = ""  # the faults that were last reported
    at: float = -math.inf  # s, when they were

    def due(self, faults: Sequence[Fault], now: float) -> bool:
        """Whether these faults are to be reported at a time (s)."""
        news = " ".join(f"{fault.part} {fault.kind}" for fault in faults)
        if news == self.news and now - self.at < REPEATED - 0.5 * PERIOD:
            return False
        self.news, self.at = news, now
        return True


def _take(watch: MessageWatch, samples: Sequence[AlignedSample]) -> None:
    for moment, sample, _ in samples:
        watch.now, watch.stamp_ns = moment, streaming.stamp_of(watch.alignment, moment)
        count = watch.state.history.count
        rate_limits.move(watch.limits, moment, sample)
        monitor.update(watch.state, moment, sample)
        if watch.state.history.count > count and watch.state.history.latest is not None:
            rate_limits.take(watch.limits, watch.state.history.latest, watch.state.whitening.filter)


def _time_of(taken: AlignmentState, stamp_ns: int) -> float:
    """Seconds since the first IMU message, the samples' time."""
    base = taken.imu.bases[-1]
    return (stamp_ns - base.stamp + base.since) / _SECOND


def _controls(actuation: Actuation, names: Sequence[str], positions: Sequence[float]) -> tuple[float, ...]:
    """Controls (rad) of joint positions; empty where these are rejected."""
    found = actuation.of_message(actuation.places(names), positions)
    return () if isinstance(found, str) else found[1:]
