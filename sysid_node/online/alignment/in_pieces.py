"""Aligned samples of a recording that is read in pieces: a piece at once where that gives the same bits, else singly.

``streaming`` aligns message by message, as in flight. A replay gets the same bits sooner with NumPy, piece by piece:
60 s take 0.01 s instead of 0.4 s, which is why this one twin is kept. It serves as long as no clock leaps and no topic
lags behind by more than the buffer; from the first piece on where one does, ``streaming`` takes over. What a later
sample may need of the messages before it is held, so that memory does not depend on the length of the flight.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.align import (
    Rejected,
    ScreenedMessages,
    bracket,
    buffer_ns,
    interpolate,
    intervals,
    screen,
    screen_air_data,
    seconds_since,
)
from sysid_node.flight.checks import gap, imu_faults
from sysid_node.flight.commanded import commands_of, deflections, follows, take_command
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Stamps, Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.online.alignment import streaming
from sysid_node.online.alignment.stated_errors import StatedErrors
from sysid_node.online.alignment.streaming import KEPT_BUFFERS, AlignedSample, AlignmentState
from sysid_node.online.types import SAMPLE_COLUMNS

HELD_BUFFERS = KEPT_BUFFERS + 1  # more than ``streaming`` keeps: it may have to go on from here
TOPICS = (IMU, AIR_DATA, ACTUATORS)


class AlignedSamples(NamedTuple):
    """Samples in bulk: what feeding the messages one by one gives, to the last bit."""

    time: Array  # (N,) s
    samples: Array  # (N, M): SAMPLE_COLUMNS, the controls, and where commands are followed the controls' excess
    rejected: Rejected  # of all messages so far
    stamps: Stamps  # (N,) header stamps of the IMU messages, ns
    wait: Array  # (N,) s from each to the last of the messages that it lies before
    commands_from: int  # place of the first sample whose deflections follow from commands; N where none do


class Accepted(NamedTuple):
    """Accepted messages of a topic."""

    stamps: Stamps  # (N,) ns, strictly increasing
    values: Array  # (N, K)
    order: Stamps  # (N,) place among the messages of all topics

    def and_then(self, later: ScreenedMessages) -> Accepted:
        """These and later ones."""
        if not self.stamps.size:
            return Accepted(later.stamps, later.values, later.order)
        return Accepted(
            np.concatenate([self.stamps, later.stamps]),
            np.concatenate([self.values, later.values]),
            np.concatenate([self.order, later.order]),
        )

    def since(self, place: int) -> Accepted:
        """Those from a place on."""
        return Accepted(self.stamps[place:], self.values[place:], self.order[place:])


class _Neighbours(NamedTuple):
    """Of each IMU message: its later neighbour's place in air data and actuators, and what is known of both."""

    right: tuple[NDArray[np.intp], NDArray[np.intp]]
    near: tuple[NDArray[np.bool_], NDArray[np.bool_]]
    decided: NDArray[np.bool_]


def align_streams(aircraft: Aircraft, streams: Streams, max_gap: float, carried: str = "positions") -> AlignedSamples:
    """The samples of a whole recording. ``max_gap`` (s) and ``carried`` as of ``streaming.init``."""
    return PieceAlignment(aircraft, max_gap, carried).take(streams, last=True)


class PieceAlignment:
    """The alignment of a flight whose messages come in pieces, in the order in which they were recorded.

    With ``by_message`` every piece is aligned message by message.
    """

    def __init__(
        self, aircraft: Aircraft, max_gap: float, carried: str = "positions", *, by_message: bool = False
    ) -> None:
        self._aircraft, self._max_gap, self._carried = aircraft, max_gap, carried
        self._actuation, self._errors = Actuation.of(aircraft), StatedErrors.of(aircraft)
        self._commands = commands_of(aircraft, carried)
        nothing = Accepted(np.empty(0, np.int64), np.empty((0, 0)), np.empty(0, np.int64))
        self._held = [nothing] * len(TOPICS)
        self._done = 0  # of the held IMU messages, those that are decided
        self._given = 0  # of the held actuators' messages, those that the servos were told
        self._first: int | None = None  # ns, stamp of the first accepted IMU message
        self._commanded = False
        self._rejected: Rejected = {topic: {} for topic in TOPICS}
        self._single: AlignmentState | None = None
        if by_message:
            self._single = streaming.init(aircraft, max_gap, carried)

    @property
    def regular(self) -> bool:
        """Whether all pieces so far were aligned at once."""
        return self._single is None

    @property
    def rejected(self) -> Rejected:
        """Messages left out so far, by topic and reason."""
        return self._rejected if self._single is None else self._single.rejected

    def take(self, piece: Streams, *, last: bool = False) -> AlignedSamples:
        """The samples that the next messages complete. ``last``: no more come."""
        if self._single is None:
            found = self._at_once(piece, last)
            if found is not None:
                return found
            self._single = self._one_by_one_from_here()
        return self._one_by_one(self._single, piece)

    def _at_once(self, piece: Streams, last: bool) -> AlignedSamples | None:
        """The same by arrays; None, and nothing is taken, where that may give other samples."""
        new = self._screened(piece)
        if any(topic.steps_back >= 0 or topic.steps_forward for topic in new):
            return None
        imu, *others = topics = [held.and_then(later) for held, later in zip(self._held, new, strict=True)]
        found = self._neighbours(imu, others, last)
        if found is None or not _came_together(imu, others, found, self._max_gap):
            return None
        fresh = found.decided & (np.arange(imu.stamps.size) >= self._done)
        self._count(new, found.near, fresh)
        if self._first is None and imu.stamps.size:
            self._first = int(imu.stamps[0])
        aligned = self._samples(topics, found, np.flatnonzero(found.near[0] & found.near[1] & fresh))
        self._hold(topics, found.decided)
        return aligned

    def _screened(self, piece: Streams) -> list[ScreenedMessages]:
        """What is accepted of a piece, without the errors that the aircraft file states."""
        controls, faults = self._actuation.of_array(piece.actuators.names, piece.actuators.positions)
        late = (0, *self._errors.late.values())
        last = [int(h.stamps[-1]) + by if h.stamps.size else None for h, by in zip(self._held, late, strict=True)]
        found = [
            screen(piece.imu.arrival, piece.imu.values, imu_faults(piece.imu.values), last[0]),
            screen_air_data(self._aircraft, piece.air_data, last[1]),
            screen(piece.actuators.arrival, controls, faults, last[2]),
        ]
        if self._errors.none:
            return found
        corrected = [_by_column(self._errors.imu, found[0].values), _by_column(self._errors.air_data, found[1].values)]
        values = (*corrected, found[2].values)
        return [
            replace(one, stamps=one.stamps - by, values=each) for one, by, each in zip(found, late, values, strict=True)
        ]

    def _neighbours(self, imu: Accepted, others: Sequence[Accepted], last: bool) -> _Neighbours | None:
        """The neighbours of all IMU messages; None where one waits for longer than the buffer holds it."""
        at, found = imu.stamps, [bracket(other.stamps, imu.stamps, self._max_gap) for other in others]
        (right_air, near_air, wait_air), (right_act, near_act, wait_act) = found
        decided = ~(wait_air | wait_act)
        late = at < at[-1] - buffer_ns(self._max_gap) if at.size else np.empty(0, bool)
        if not last and (late & ~decided).any():
            return None
        return _Neighbours((right_air, right_act), (near_air, near_act), decided | late)

    def _count(
        self,
        new: Sequence[ScreenedMessages],
        near: tuple[NDArray[np.bool_], NDArray[np.bool_]],
        fresh: NDArray[np.bool_],
    ) -> None:
        """Count what is left out: messages by themselves, and IMU messages without neighbours."""
        gaps = {
            gap(AIR_DATA): int(np.count_nonzero(fresh & ~near[0])),
            gap(ACTUATORS): int(np.count_nonzero(fresh & near[0] & ~near[1])),
        }
        counted = [{**new[0].rejected, **{reason: count for reason, count in gaps.items() if count}}]
        for topic, reasons in zip(TOPICS, [*counted, new[1].rejected, new[2].rejected], strict=True):
            total = self._rejected[topic]
            for reason, count in reasons.items():
                total[reason] = total.get(reason, 0) + count

    def _samples(self, topics: Sequence[Accepted], found: _Neighbours, used: NDArray[np.intp]) -> AlignedSamples:
        """The samples of the IMU messages at the places ``used``."""
        imu, air, actuators = topics
        at, right_air, right_act = imu.stamps[used], found.right[0][used], found.right[1][used]
        if not used.size:
            width = len(SAMPLE_COLUMNS) + len(self._aircraft.controls)
            return AlignedSamples(np.empty(0), np.empty((0, width)), self.rejected, at, np.empty(0), 0)
        actuated, begin = self._actuated(actuators, right_act, at)
        parts = [
            imu.values[used],
            interpolate(air.stamps, air.values, right_air, at),
            actuated[:, :1],
            intervals(air.stamps, self._max_gap)[right_air],
            actuated[:, 1:],
        ]
        wait = seconds_since(0, np.maximum(air.stamps[right_air], actuators.stamps[right_act]) - at)
        time = seconds_since(self._first or 0, at)
        return AlignedSamples(time, np.column_stack(parts), self.rejected, at, wait, begin)

    def _actuated(self, messages: Accepted, right: NDArray[np.intp], at: Stamps) -> tuple[Array, int]:
        """Thrust and deflections at the stamps ``at`` (n,), and the place from which commands make them.

        (n, 1 + controls), or with the deflections' excess (n, 1 + 2 controls) where they do at all. The calls are those
        of ``streaming`` in the same order.
        """
        actuated, begin, commands = interpolate(messages.stamps, messages.values, right, at), len(at), self._commands
        if commands is None:
            return actuated, begin
        for k, (moment, last) in enumerate(zip(at.tolist(), right.tolist(), strict=True)):
            self._give(messages, last + 1)
            if not follows(commands, 0, moment):
                continue
            if begin == len(at):
                begin = k
                actuated = np.hstack([actuated, np.zeros((len(at), messages.values.shape[1] - 1))])
            actuated[k] = deflections(commands, 0, moment, ())
            self._commanded = True
        return actuated, begin

    def _give(self, messages: Accepted, until: int) -> None:
        """Tell the servos the actuators' messages before the place ``until``."""
        while self._given < until:
            if self._commands is not None:
                values = messages.values[self._given].tolist()
                take_command(self._commands, 0, int(messages.stamps[self._given]), values)
            self._given += 1

    def _hold(self, topics: Sequence[Accepted], decided: NDArray[np.bool_]) -> None:
        """Keep what later samples may need."""
        imu, *others = topics
        waiting = int(np.argmin(decided)) if decided.size and not decided.all() else decided.size
        first = max(waiting - 1, 0)
        self._done = waiting - first
        held = [imu.since(first)]
        for place, other in enumerate(others, 1):
            stamps = other.stamps
            if stamps.size and imu.stamps.size:
                needed = imu.stamps[waiting] if waiting < decided.size else imu.stamps[-1] + 1
                start = max(int(np.searchsorted(stamps, needed)) - 2, 0)
            else:
                start = 0
            if stamps.size:
                horizon = stamps[-1] - HELD_BUFFERS * buffer_ns(self._max_gap)
                start = max(start, int(np.searchsorted(stamps, horizon)))
            if TOPICS[place] == ACTUATORS:
                self._give(other, start)
                self._given -= start
            held.append(other.since(start))
        self._held = held

    def _one_by_one_from_here(self) -> AlignmentState:
        """The state of ``streaming`` after the messages so far."""
        imu, air, actuators = self._held
        self._give(actuators, actuators.stamps.size)
        state = streaming.init(self._aircraft, self._max_gap, self._carried)
        if self._first is not None:
            waiting = imu.since(self._done)
            streaming.go_on_from(state, self._first, int(imu.stamps[-1]), *_rows(waiting))
        streaming.go_on_after(state, AIR_DATA, *_rows(air))
        streaming.go_on_after(state, ACTUATORS, *_rows(actuators))
        state.commands, state.rejected = self._commands, self._rejected
        if self._commanded:
            state.commands_from = -np.inf
        return state

    def _one_by_one(self, state: AlignmentState, piece: Streams) -> AlignedSamples:
        """Feeds the messages in the order in which they came."""
        imu, air_data, actuators = piece.imu, piece.air_data, piece.actuators
        order = np.concatenate([stream.arrival.order for stream in (imu, air_data, actuators)])
        topics = np.repeat([0, 1, 2], [len(imu.arrival), len(air_data.arrival), len(actuators.arrival)])
        rows = np.concatenate([np.arange(np.count_nonzero(topics == topic)) for topic in (0, 1, 2)])
        stamps = [stream.arrival.stamp_ns.tolist() for stream in (imu, air_data, actuators)]
        values = [stream.tolist() for stream in (imu.values, air_data.values, actuators.positions)]
        complete: list[AlignedSample] = []
        sources: list[int] = []
        for place in np.argsort(order, kind="stable"):
            topic, row = int(topics[place]), int(rows[place])
            if topic == 0:
                new = streaming.on_imu(state, stamps[0][row], tuple(values[0][row]))
            elif topic == 1:
                new = streaming.on_air_data(state, stamps[1][row], tuple(values[1][row]))
            else:
                new = streaming.on_actuators(state, stamps[2][row], actuators.names, values[2][row])
            complete += new
            sources += [streaming.stamp_of(state, one.time) for one in new]
        return self._of_rows(state, complete, sources)

    def _of_rows(self, state: AlignmentState, complete: list[AlignedSample], sources: list[int]) -> AlignedSamples:
        """Samples as arrays, zeros where they have no excess."""
        least = len(SAMPLE_COLUMNS) + len(self._aircraft.controls)
        width = max((len(one.sample) for one in complete), default=least)
        time, wait = (np.array([one[i] for one in complete], np.float64) for i in (0, 2))
        samples = np.array([(*one.sample, *(0.0,) * (width - len(one.sample))) for one in complete])
        begin = int(np.searchsorted(time, state.commands_from))
        stamps = np.array(sources, np.int64)
        return AlignedSamples(time, samples.reshape(len(complete), width), state.rejected, stamps, wait, begin)


def _by_column(change: Callable[[tuple[Array, ...]], tuple[Array, ...]], values: Array) -> Array:
    """Values (N, K), changed by columns."""
    return np.column_stack(change(tuple(values.T)))


def _rows(messages: Accepted) -> tuple[list[int], list[tuple[float, ...]]]:
    """Stamps and values."""
    return messages.stamps.tolist(), list(map(tuple, messages.values.tolist()))


def _came_together(imu: Accepted, others: Sequence[Accepted], found: _Neighbours, max_gap: float) -> bool:
    """Whether no message had to wait for another for longer than the buffer holds it."""
    buffer = buffer_ns(max_gap)
    if any(topic.stamps.size > 1 and int(np.diff(topic.stamps).max()) > buffer for topic in (imu, *others)):
        return False  # a silence longer than the buffer: what waited for its end was given up before
    pairs = list(zip(others, found.right, strict=True))
    decided = np.flatnonzero(np.logical_and.reduce([right < other.stamps.size for other, right in pairs]))
    complete = imu.order[decided]  # when the last of the messages that a sample needs has come
    for other, right in pairs:
        complete = np.maximum(complete, other.order[right[decided]])
    in_time = complete < _order_after(imu, imu.stamps[decided] + buffer)
    for other, right in pairs:
        left = np.maximum(right[decided] - 1, 0)
        in_time &= complete < _order_after(other, other.stamps[left] + KEPT_BUFFERS * buffer)
    return bool(in_time.all())


def _order_after(topic: Accepted, stamps: Stamps) -> Stamps:
    """When the first message stamped later than each of ``stamps`` came; far in the future where none did."""
    after = np.searchsorted(topic.stamps, stamps, side="right")
    return np.append(topic.order, np.iinfo(np.int64).max)[after]
