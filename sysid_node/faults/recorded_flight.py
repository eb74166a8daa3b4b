"""Replays a recorded flight through the fault monitor: what the live node would have reported, and when.

Messages are taken in the order in which they were recorded; the recorder's clock shows which topic was silent. The
identifier's estimates are taken directly after the sample with their stamp.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from sysid_node.aircraft.model import Aircraft
from sysid_node.faults import watch as watching
from sysid_node.faults.model.reference_model import IdentifierEstimates
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.types import FORCES, Fault
from sysid_node.faults.watch import PERIOD, STALE_AFTER, Announcements, MessageWatch
from sysid_node.flight.commands import JointMessage
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Stream, Streams

_SECOND = 1e9  # ns
REPORT_EVERY = 512  # messages between reports of progress
_LONGEST_SILENCE = 300_000_000_000  # ns between two messages; what is longer is not time that passed in the flight


class RecordedEstimates(NamedTuple):
    """The identifier's estimates at the sample with a header stamp."""

    stamp_ns: int
    known: IdentifierEstimates


class FaultReport(NamedTuple):
    """The faults reported after the sample with a header stamp, at a time (s since the first IMU message)."""

    stamp_ns: int
    time: float
    faults: tuple[Fault, ...]


class Episode(NamedTuple):
    """A fault as last reported, and the time (s) at which it ended; None: it lasted to the end."""

    fault: Fault
    until: float | None

    @property
    def text(self) -> str:
        """In one line."""
        end = "to the end" if self.until is None else f"until {self.until:.1f} s"
        return f"{self.fault.text}; since {self.fault.since:.1f} s, found at {self.fault.found:.1f} s, {end}"


@dataclass(frozen=True)
class FaultVerdict:
    """The result for a flight: seconds checked, all reports, and each fault in the order in which it was found."""

    judged: float
    reports: Sequence[FaultReport] = ()
    episodes: Sequence[Episode] = ()

    @property
    def sentences(self) -> list[str]:
        """Each fault in one line; without faults, how long the flight was checked."""
        if self.episodes:
            return [episode.text for episode in self.episodes]
        if not self.judged:
            return [
                "no faults were looked for: the flight is too short, or has too many gaps, to learn sound flight from"
            ]
        return [f"nothing that failed was found in the {self.judged:.0f} s that were judged"]


class RecordedMonitor:
    """The monitor of a recording that is heard in pieces, in the order in which they were recorded."""

    def __init__(self, aircraft: Aircraft, settings: FaultMonitorSettings) -> None:
        self._watch, self._speech = watching.init(aircraft, settings, STALE_AFTER), Announcements()
        self._reports: list[FaultReport] = []
        self._pending: deque[RecordedEstimates] = deque()
        self._clock: tuple[int, int] | None = None  # ns: the last log time, and what to take off log times
        self._looks = 0

    def hear(
        self,
        streams: Streams,
        commands: Sequence[JointMessage] = (),
        estimates: Iterable[RecordedEstimates] = (),
        progress: Callable[[float], None] | None = None,
    ) -> None:
        """Take the next messages, and the estimates that fell due among them.

        ``commands`` are in log order, ``progress`` is told the share of these messages that is done.
        """
        self._pending.extend(estimates)
        watch, messages = self._watch, _messages(streams, commands)
        for place, (message, now) in enumerate(zip(messages, self._times(messages), strict=True)):
            while (self._looks + 1) * PERIOD < now:
                self._looks += 1
                faults = watching.present_faults(watch, self._looks * PERIOD)
                if self._speech.due(faults, self._looks * PERIOD):
                    self._reports.append(FaultReport(watch.stamp_ns, watch.now, tuple(faults)))
            message.take(watch, now)
            while self._pending and self._pending[0].stamp_ns <= watch.stamp_ns:
                watching.on_estimates(watch, self._pending.popleft().known)
            if progress is not None and place % REPORT_EVERY == 0:
                progress((place + 1) / len(messages))

    @property
    def verdict(self) -> FaultVerdict:
        """On what was heard."""
        return FaultVerdict(self._watch.judged, self._reports, episodes(self._reports))

    def _times(self, messages: Sequence[_Message]) -> list[float]:
        """Seconds since the first log time, without jumps: a clock that was set, or a pause of the recorder."""
        times = []
        for message in messages:
            before, shift = self._clock or (message.log_ns, message.log_ns)
            shift += max(message.log_ns - before - _LONGEST_SILENCE, 0)
            self._clock = message.log_ns, shift
            times.append((message.log_ns - shift) / _SECOND)
        return times


def judge(
    aircraft: Aircraft,
    settings: FaultMonitorSettings,
    streams: Streams,
    commands: Sequence[JointMessage] = (),
    estimates: Iterable[RecordedEstimates] = (),
    progress: Callable[[float], None] | None = None,
) -> FaultVerdict:
    """The monitor's verdict on a whole recording; the arguments are those of ``RecordedMonitor.hear``."""
    monitor = RecordedMonitor(aircraft, settings)
    monitor.hear(streams, commands, estimates, progress)
    return monitor.verdict


def episodes(reports: Sequence[FaultReport]) -> list[Episode]:
    """Each fault among the reports, once."""
    found: dict[tuple[str, float, str], Episode] = {}
    present: set[tuple[str, float, str]] = set()
    for moment in reports:
        now = {_key(fault): fault for fault in moment.faults}
        for key in present - now.keys():
            found[key] = found[key]._replace(until=moment.time)
        found |= {key: Episode(fault, None) for key, fault in now.items()}
        present = set(now)
    return sorted(found.values(), key=lambda episode: episode.fault.found)


def _key(fault: Fault) -> tuple[str, float, str]:
    """What identifies a fault. The part of one that was found by forces may change between reports."""
    return fault.source, fault.found, "" if fault.source == FORCES else fault.part


class _Message(NamedTuple):
    """A recorded message, its place among those recorded at the same time, and the function that takes it."""

    log_ns: int
    order: int
    take: Callable[[MessageWatch, float], None]


def _messages(streams: Streams, commands: Sequence[JointMessage]) -> list[_Message]:
    """All messages in the order in which they were recorded; commands come last among those of the same time."""
    names = streams.actuators.names

    def on_actuators(watch: MessageWatch, now: float, stamp_ns: int, positions: tuple[float, ...]) -> None:
        watching.on_actuators(watch, now, stamp_ns, names, positions)

    def on_command(command: JointMessage, watch: MessageWatch, _: float) -> None:
        watching.on_command(watch, command.stamp_ns, command.names, command.positions)

    found = [
        *_of_stream(streams.imu, streams.imu.values, watching.on_imu),
        *_of_stream(streams.air_data, streams.air_data.values, watching.on_air_data),
        *_of_stream(streams.actuators, streams.actuators.positions, on_actuators),
    ]
    found += [_Message(one.log_ns, len(found), partial(on_command, one)) for one in commands]
    return sorted(found, key=lambda message: message[:2])


def _of_stream(
    stream: Stream, values: Array, take: Callable[[MessageWatch, float, int, tuple[float, ...]], None]
) -> list[_Message]:
    def taken(stamp_ns: int, row: tuple[float, ...], watch: MessageWatch, now: float) -> None:
        take(watch, now, stamp_ns, row)

    arrival = stream.arrival
    columns = (arrival.log_ns.tolist(), arrival.order.tolist(), arrival.stamp_ns.tolist(), map(tuple, values.tolist()))
    return [
        _Message(log_ns, order, partial(taken, stamp, row)) for log_ns, order, stamp, row in zip(*columns, strict=True)
    ]
