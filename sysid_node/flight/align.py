"""Aligns three topics of different rates to one sample per IMU message, for a whole recording.

The IMU's stamps are the time base. Air data and actuators are interpolated linearly in stamp time between their
neighbours. To hold the last value instead would delay it by half a period on average, T. The angle of attack moves with
the pitch rate, so that a delay of it appears as damping: Cm_q is off by up to Cm_alpha 2 V T / cbar. With air data held
at 100 Hz (T = 5 ms), 18 m/s and a chord of 0.3 m this is 0.6 Cm_alpha; where Cm_alpha = -0.6 and Cm_q = -7, 5 %.
Interpolation has no delay. Its amplitude error is (w h)^2 / 12 at angular frequency w and period h: 0.1 % at 2 Hz.

IMU messages between neighbours that are more than ``max_gap`` apart are left out and counted.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.checks import (
    BEYOND,
    DUPLICATE,
    LATEST_STAMP_NS,
    OUT_OF_ORDER,
    UNSTAMPED,
    air_data_faults,
    gap,
    imu_faults,
)
from sysid_node.flight.commanded import (
    AROUND,
    RecordedCommands,
    commands_of,
    deflections,
    known_from,
    take_command,
    with_excess,
)
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.flight.streams import AirDataStream, Arrival, Stamps, Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU

STEP_BACK_NS = 1_000_000_000  # a larger step back means that the clock was set, not that a message was late
STEP_FORWARD_NS = 300_000_000_000  # a larger step forward means the same
MAX_GAP = 0.2  # s: the usual ``max_gap``
BUFFER_NS = 5_000_000_000  # how long messages of a topic are kept while the others are awaited

AIR_INTERVAL = "air_interval"

Rejected = dict[str, dict[str, int]]  # topic -> reason -> messages


@dataclass(frozen=True)
class ScreenedMessages:
    """The messages of a topic that were accepted."""

    kept: NDArray[np.intp]  # places in the stream
    stamps: Stamps  # (kept), strictly increasing unless ``steps_back``
    values: Array
    order: Stamps
    rejected: Mapping[str, int]
    steps_back: int  # first place in the stream where the clock was set back, or -1
    steps_forward: bool


@dataclass(frozen=True)
class Alignment:
    """Aligned samples, and the messages that each was made of.

    ``samples`` (N, 12 + controls): ax ay az p q r V alpha beta rho thrust air_interval, then the controls in the
    aircraft's order. The air interval (s) is the time between the air-data messages on either side. Where commands are
    followed, as many columns stand behind: the deflections' excess (``servos.move``), zero in samples before that.
    """

    imu: ScreenedMessages
    others: tuple[ScreenedMessages, ScreenedMessages]  # air data, actuators
    right: tuple[NDArray[np.intp], NDArray[np.intp]]  # of each IMU sample, its later neighbour in each of the others
    used: NDArray[np.intp]  # places of the aligned samples among the IMU's accepted messages
    samples: Array
    rejected: Rejected
    commands_from: int  # the place of the first sample whose deflections follow from commands; their number for none

    @property
    def stamps(self) -> Stamps:
        """(N,) header stamps, ns."""
        return self.imu.stamps[self.used]

    @property
    def time(self) -> Array:
        """(N,) s, from the first accepted IMU message."""
        return seconds_since(self.imu.stamps[0], self.stamps) if self.used.size else np.empty(0)


def seconds_since(start_ns: int | np.int64, stamps: Stamps) -> Array:
    """Seconds since ``start_ns``, from a difference in whole nanoseconds, which float64 holds exactly for 104 days."""
    time: Array = (stamps - start_ns) / 1e9
    return time


def screen(arrival: Arrival, values: Array, faults: NDArray[np.object_], last: int | None = None) -> ScreenedMessages:
    """Leave out messages that have a fault (N,), then those whose stamp is absent, impossible, repeated or late.

    ``last`` is the latest stamp (ns) among the topic's messages before these; None = these are the first.
    """
    good = np.array([fault is None for fault in faults], bool) if faults.size else np.empty(0, bool)
    rejected = Counter(faults[~good].tolist())
    stamped, beyond = arrival.stamp_ns > 0, arrival.stamp_ns >= LATEST_STAMP_NS
    rejected[UNSTAMPED] = int(np.count_nonzero(good & ~stamped))
    rejected[BEYOND] = int(np.count_nonzero(good & beyond))
    kept = np.flatnonzero(good & stamped & ~beyond)
    step, back = _steps(arrival.stamp_ns[kept], last)
    rejected[DUPLICATE] = int(np.count_nonzero(step == 0))
    rejected[OUT_OF_ORDER] = int(np.count_nonzero(step < 0))
    fresh = kept[step > 0]
    return ScreenedMessages(
        fresh,
        arrival.stamp_ns[fresh],
        values[fresh],
        arrival.order[fresh],
        {reason: count for reason, count in rejected.items() if count},
        int(kept[back[0]]) if back.size else -1,
        bool((step > STEP_FORWARD_NS).any()),
    )


def _steps(stamps: Stamps, last: int | None) -> tuple[Stamps, NDArray[np.intp]]:
    """The step of each stamp past the latest before it (1 for the first), and the places where a clock was set back."""
    if not stamps.size:
        return stamps, np.empty(0, np.intp)
    latest = np.maximum.accumulate(stamps if last is None else np.concatenate([[last], stamps]))
    step = np.ones_like(stamps)
    if last is None:
        step[1:] = stamps[1:] - latest[:-1]
    else:
        step = stamps - latest[:-1]
    return step, np.flatnonzero(step < -STEP_BACK_NS)


def align(
    aircraft: Aircraft,
    streams: Streams,
    max_gap: float,
    carried: str = "positions",
    *,
    afterwards: bool = False,
    servos: bool = True,
) -> Alignment:
    """One sample for each IMU message between neighbours in air data and actuators at most ``max_gap`` (s) apart.

    IMU messages at the end whose later neighbours are missing are neither used nor rejected, unless they waited longer
    than the buffer. The stamps decide, not the order of arrival. Where a clock was set back in the recording
    (``steps_back``), the messages after that are left out as late.

    ``carried`` says what the actuators' messages are. Where it is "auto" and they turn out to be commands, all samples
    take their deflections from commands if that is decided ``afterwards``, else those after the messages that tell,
    as in flight. ``servos``: whether the aircraft file's servos follow the commands.
    """
    imu = screen(streams.imu.arrival, streams.imu.values, imu_faults(streams.imu.values))
    air = screen_air_data(aircraft, streams.air_data)
    thrust_and_controls, faults = Actuation.of(aircraft).of_array(streams.actuators.names, streams.actuators.positions)
    actuators = screen(streams.actuators.arrival, thrust_and_controls, faults)
    at = imu.stamps
    late = at < at[-1] - buffer_ns(max_gap) if at.size else np.empty(0, bool)
    right_air, near_air, wait_air = bracket(air.stamps, at, max_gap)
    right_act, near_act, wait_act = bracket(actuators.stamps, at, max_gap)
    decided = ~(wait_air | wait_act) | late
    used = np.flatnonzero(near_air & near_act)
    if carried == "auto" and afterwards:
        carried = "commands" if known_from(actuators.stamps, actuators.values[:, 1:]) is not None else "positions"
    commands = commands_of(aircraft, carried, servos=servos)
    actuated, commands_from = _actuated(commands, actuators, right_act[used], at[used])
    of_air = interpolate(air.stamps, air.values, right_air[used], at[used])
    every = intervals(air.stamps, max_gap)[right_air[used]]
    samples = np.column_stack([imu.values[used], of_air, actuated[:, :1], every, actuated[:, 1:]])
    missing = {AIR_DATA: decided & ~near_air, ACTUATORS: decided & near_air & ~near_act}
    gaps = {gap(topic): int(np.count_nonzero(where)) for topic, where in missing.items()}
    rejected = _rejected(imu, air, actuators, gaps)
    return Alignment(imu, (air, actuators), (right_air, right_act), used, samples, rejected, commands_from)


def _rejected(
    imu: ScreenedMessages, air: ScreenedMessages, actuators: ScreenedMessages, gaps: Mapping[str, int]
) -> Rejected:
    """Messages left out by topic and reason; ``gaps`` are IMU messages without neighbours in another topic."""
    return {
        IMU: {**imu.rejected, **{reason: count for reason, count in gaps.items() if count}},
        AIR_DATA: dict(air.rejected),
        ACTUATORS: dict(actuators.rejected),
    }


def _actuated(
    commands: RecordedCommands | None, messages: ScreenedMessages, right: NDArray[np.intp], at: Stamps
) -> tuple[Array, int]:
    """Thrust and deflections at the stamps ``at`` (n,), and the place from which commands make them.

    (n, 1 + controls), or with the deflections' excess (n, 1 + 2 controls) where they do at all. The calls are those of
    ``online.alignment.streaming`` in the same order, so that both give the same bits.
    """
    stamps, values = messages.stamps, messages.values
    actuated = interpolate(stamps, values, right, at)
    if commands is None:
        return actuated, len(at)
    known = 0 if commands.decided else known_from(stamps, values[:, 1:])
    if known is None:
        return actuated, len(at)
    begin = 0 if commands.decided else int(np.searchsorted(at, stamps[known - 1], side="right"))
    first = 0 if commands.decided else known - AROUND - 1  # the servos are at rest on this message's command
    if not commands.decided:
        commands.since = 0, int(stamps[known - 1])
    rows = zip(stamps[first:].tolist(), values[first:].tolist(), strict=True)
    given = first
    actuated = np.hstack([actuated, np.zeros((len(at), values.shape[1] - 1))])
    for k, (moment, last) in enumerate(zip(at[begin:].tolist(), right[begin:].tolist(), strict=True), begin):
        while given <= last:
            take_command(commands, 0, *next(rows))
            given += 1
        actuated[k] = deflections(commands, 0, moment, ())
    return actuated, begin


def screen_air_data(aircraft: Aircraft, stream: AirDataStream, last: int | None = None) -> ScreenedMessages:
    """The accepted air data, with the reference density where none is measured; ``last`` as of ``screen``."""
    values = stream.values
    density = np.where(np.isnan(values[:, 3]), aircraft.reference.air_density, values[:, 3])
    return screen(stream.arrival, np.column_stack([values[:, :3], density]), air_data_faults(values), last)


def warn_without_density(aircraft: Aircraft, name: str) -> None:
    """Warn (InputWarning) that no air density was measured in a flight, so that the aircraft file's is taken."""
    warnings.warn(
        f"{name}: no air density was recorded; the aircraft file's {aircraft.reference.air_density:.3g} kg/m^3 is "
        "taken, and where it is wrong, all derivatives are wrong by the same factor: record it (from pressure and "
        "temperature), or give reference.air_density the flight's value",
        InputWarning,
        stacklevel=2,
    )


def buffer_ns(max_gap: float) -> int:
    """How long an IMU message waits for its neighbours, ns by its own stamps."""
    return max(BUFFER_NS, 2 * gap_ns(max_gap))


def gap_ns(max_gap: float) -> int:
    """The longest gap in ns."""
    return round(max_gap * 1e9)


def bracket(
    stamps: Stamps, at: Stamps, max_gap: float
) -> tuple[NDArray[np.intp], NDArray[np.bool_], NDArray[np.bool_]]:
    """For each ``at``: the place of its later neighbour, whether both are near enough, whether one is missing.

    A stamp that is equal to ``at`` needs no other neighbour.
    """
    right = np.searchsorted(stamps, at, side="left")
    waits = right == stamps.size
    if not stamps.size:
        return right, ~waits, waits
    place = np.minimum(right, stamps.size - 1)
    exact = ~waits & (stamps[place] == at)
    near = ~waits & (place > 0) & (stamps[place] - stamps[place - 1] <= gap_ns(max_gap))
    return right, exact | near, waits


def intervals(stamps: Stamps, max_gap: float) -> Array:
    """Time (s) from the stamp before to each stamp, at most ``max_gap``; zero for the first."""
    since: Array = np.minimum(np.diff(stamps, prepend=stamps[:1]), gap_ns(max_gap)) / 1e9
    return since


def interpolate(stamps: Stamps, values: Array, right: NDArray[np.intp], at: Stamps) -> Array:
    """Values (n, K) at the stamps ``at`` (n,), each on the line through its later neighbour and the one before that.

    ``online.alignment.streaming`` does the same operations in the same order, so that both give the same bits.
    """
    left = np.maximum(right - 1, 0)
    exact = stamps[right] == at
    span = np.where(exact, 1, stamps[right] - stamps[left])
    weight = ((at - stamps[left]) / span)[:, np.newaxis]
    between = values[left] + weight * (values[right] - values[left])
    result: Array = np.where(exact[:, np.newaxis], values[right], between)
    return result


def counts_by_reason(rejected: Mapping[str, Mapping[str, int]]) -> dict[str, int]:
    """Counts by ``"<topic>: <reason>"``."""
    return {f"{topic}: {reason}": n for topic, reasons in rejected.items() for reason, n in reasons.items()}


def flight_record(
    aircraft: Aircraft, streams: Streams, max_gap: float, carried: str = "positions", *, servos: bool = True
) -> FlightRecord:
    """The flight as aligned columns, with the attitude where the IMU's messages hold one.

    ``carried`` and ``servos`` are those of ``align``; what the messages carry is decided by the whole flight.

    Raises InputError where nothing could be aligned, or a clock was set back during the recording.
    """
    aligned = align(aircraft, streams, max_gap, carried, afterwards=True, servos=servos)
    _require_one_clock(streams, aligned)
    if aligned.used.size < 2:
        Actuation.of(aircraft).require(streams.actuators.names, streams.name)
        raise InputError(why_nothing_aligned(streams.name, stamp_spans(streams), aligned.rejected, max_gap))
    samples, names = aligned.samples, sample_columns(aircraft)
    if samples.shape[1] > len(names):
        first = len(names) - len(aircraft.controls)
        samples = np.hstack([samples[:, :first], with_excess(aligned.stamps, samples[:, first:])])
    columns = dict(zip(names, np.ascontiguousarray(samples.T), strict=True))
    interval = float(np.mean(columns.pop(AIR_INTERVAL)))
    attitude = streams.imu.attitude[aligned.imu.kept[aligned.used]]
    columns |= dict(zip(("phi", "theta", "psi"), np.ascontiguousarray(attitude.T), strict=True))
    start = int(aligned.imu.stamps[0])
    commanded = aligned.commands_from < aligned.used.size
    rejected = counts_by_reason(aligned.rejected)
    between = streams.actuators.interval
    return FlightRecord(aligned.time, columns, streams.name, start, rejected, commanded, interval, between)


def sample_columns(aircraft: Aircraft) -> tuple[str, ...]:
    """The names of the columns of an aligned sample."""
    measured = ("ax", "ay", "az", "p", "q", "r", "V", "alpha", "beta", "rho", "thrust", AIR_INTERVAL)
    return (*measured, *aircraft.control_symbols)


def _require_one_clock(streams: Streams, aligned: Alignment) -> None:
    """Raise InputError, which names topic and time, where a clock was set back during the recording."""
    for (topic, stream), screened in zip(streams.by_topic.items(), (aligned.imu, *aligned.others), strict=True):
        if screened.steps_back >= 0:
            log_ns = stream.arrival.log_ns
            after = (log_ns[screened.steps_back] - log_ns[0]) / 1e9
            raise InputError(
                f"{streams.name}: the stamps of {topic} go back {after:.1f} s into the recording "
                "(a clock was set, or a loop was recorded); cut the recording there"
            )


def stamp_spans(streams: Streams) -> dict[str, tuple[float, float]]:
    """The first and the last header stamp (s) of each topic that has messages."""
    stamps = {topic: stream.arrival.stamp_ns / 1e9 for topic, stream in streams.by_topic.items()}
    return {topic: (float(t.min()), float(t.max())) for topic, t in stamps.items() if t.size}


def joined_spans(
    first: Mapping[str, tuple[float, float]], second: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """The spans that hold both, by topic."""
    both = {topic: (*first.get(topic, ()), *second.get(topic, ())) for topic in {**first, **second}}
    return {topic: (min(times), max(times)) for topic, times in both.items()}


def why_nothing_aligned(
    name: str,
    spans: Mapping[str, tuple[float, float]],
    rejected: Mapping[str, Mapping[str, int]],
    max_gap: float = MAX_GAP,
) -> str:
    """One line: topics of a single time, or spans that do not overlap, else the most frequent reasons of rejection.

    ``name`` is the flight's, ``spans`` as of ``stamp_spans``, ``max_gap`` (s) as of ``align``.
    """
    single = [topic for topic, (start, stop) in spans.items() if start == stop]
    if single:
        return f"{name}: all of {', '.join(single)} is of a single time; at least two messages of each topic are needed"
    if max(start for start, _ in spans.values()) > min(stop for _, stop in spans.values()):
        intervals = ", ".join(f"{topic} {start:.3f} to {stop:.3f} s" for topic, (start, stop) in spans.items())
        return f"{name}: the header stamps do not overlap: {intervals}; stamp all topics with one clock"
    worst = sorted(counts_by_reason(rejected).items(), key=lambda item: -item[1])[:3]
    reasons = "; ".join(f"{count} x {reason}" for reason, count in worst) or "fewer than two IMU messages"
    rare = [topic for topic in (AIR_DATA, ACTUATORS) if worst and worst[0][0] == f"{IMU}: {gap(topic)}"]
    usual = "correct the messages or the aircraft file"
    often = f"at least every {max_gap:g} s ({1.0 / max_gap:.3g} Hz)"
    remedy = f"{rare[0]} must come {often}, or max_gap be longer" if rare else usual
    return f"{name}: no two samples could be aligned: {reasons}; {remedy}"
