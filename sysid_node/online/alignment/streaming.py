"""Streaming alignment: from messages, one by one as they come, to aligned samples.

The live node and the replay both feed this. Each message is checked (``flight.checks``: plausible values; here: its
stamp), and every IMU message waits until air data and actuators stamped after it have come, so that both are
interpolated and never held (``flight.align`` says why); only commands are held (``flight.commanded``). What comes out
depends on the stamps alone, not on the order in which topics arrive, as long as none is more than the buffer (5 s)
behind; a replay therefore equals the live run. Errors of the instruments and delays of the stamps that the aircraft
file states are taken out of every message that is accepted (``stated_errors``).

A stamp that leaps (back by more than 1 s, ahead by more than 5 min) is left out; if the next message follows it, the
clock was set, and a new time base begins: the samples' time goes on after a break longer than ``max_gap``, which
no estimator integrates across. Messages before and after a step are never combined.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import NamedTuple

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.align import STEP_BACK_NS, STEP_FORWARD_NS, Rejected, buffer_ns, gap_ns
from sysid_node.flight.checks import (
    BEYOND,
    CLOCK_STEP,
    DUPLICATE,
    LATEST_STAMP_NS,
    OUT_OF_ORDER,
    UNSTAMPED,
    air_data_fault,
    gap,
    imu_fault,
    is_nan,
)
from sysid_node.flight.commanded import RecordedCommands, commands_of, deflections, follows, take_command
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.online.alignment.stated_errors import StatedErrors

FOLLOWS_NS = 1_000_000_000  # a message this soon after a leap of the stamps confirms it
BREAK_NS = 1_000_000_000  # beyond max_gap: the break in the samples' time where a clock was set
KEPT_BUFFERS = 2  # an IMU message that has waited for one topic finds its neighbours in the other still there

Sample = tuple[float, ...]
Values = tuple[float, ...]


@dataclass(slots=True)
class _Clock:
    """The stamps of one topic."""

    last: int | None = None
    jumped_to: int | None = None
    epoch: int = 0  # how often the clock was set

    def fault(self, stamp: int) -> str | None:
        """What is wrong with the next stamp, or None: it is taken."""
        if not 0 < stamp < LATEST_STAMP_NS:
            return UNSTAMPED if stamp <= 0 else BEYOND
        step = 1 if self.last is None else stamp - self.last
        if 0 < step <= STEP_FORWARD_NS:
            self.last, self.jumped_to = stamp, None
            return None
        if -STEP_BACK_NS <= step <= 0:
            return OUT_OF_ORDER if step else DUPLICATE
        if self.jumped_to is not None and 0 < stamp - self.jumped_to <= FOLLOWS_NS:
            self.last, self.jumped_to = stamp, None
            self.epoch += 1
            return None
        self.jumped_to = stamp
        return CLOCK_STEP


class _Missing(Enum):
    """Why a topic has no values at an IMU message's stamp."""

    AS_YET = auto()  # a neighbour may still come
    FOR_GOOD = auto()


class AlignedSample(NamedTuple):
    """A sample that is complete: SAMPLE_COLUMNS, the aircraft's controls, and their excess where commands are followed.

    The excess is that of ``flight.servos.move``.
    """

    time: float  # s
    sample: Sample
    wait: float  # s from its own stamp to that of the last message that it lies before


class _Entry(NamedTuple):
    """A message that is believed."""

    epoch: int
    stamp: int
    interval: int  # ns since the message before, at most max_gap
    values: Values


_Pair = tuple[_Entry, _Entry]


class _Waiting(NamedTuple):
    """An IMU message that waits for its neighbours in the other topics."""

    epoch: int
    stamp: int
    since: int  # ns from the first IMU message, breaks included
    values: Values


class _Base(NamedTuple):
    """The first IMU message of an epoch."""

    epoch: int
    since: int
    stamp: int


@dataclass(slots=True)
class _Neighbours:
    """Recent messages of a topic that is interpolated."""

    topic: str
    late: int = 0  # ns, by which its stamps are later than the IMU's
    clock: _Clock = field(default_factory=_Clock)
    entries: deque[_Entry] = field(default_factory=deque)
    newest: _Entry | None = None
    ahead: int = 0  # the topic's epoch less the IMU's, where their clocks were not set together


@dataclass(slots=True)
class _ImuMessages:
    """The IMU's messages: those that wait, and the time base that their stamps make."""

    clock: _Clock = field(default_factory=_Clock)
    waiting: deque[_Waiting] = field(default_factory=deque)
    since: int = 0  # of the last one
    bases: deque[_Base] = field(default_factory=lambda: deque(maxlen=16))  # of the last epochs


@dataclass(slots=True)
class AlignmentState:
    """All that the alignment remembers. ``accepted`` and ``rejected`` count messages by topic (and reason)."""

    actuation: Actuation
    air_density: float
    gap: int  # ns
    buffer: int  # ns
    errors: StatedErrors = field(default_factory=StatedErrors)
    imu: _ImuMessages = field(default_factory=_ImuMessages)
    air_data: _Neighbours = field(default_factory=lambda: _Neighbours(AIR_DATA))
    actuators: _Neighbours = field(default_factory=lambda: _Neighbours(ACTUATORS))
    commands: RecordedCommands | None = None  # None: the topic carries positions
    commands_from: float = math.inf  # s: time of the first sample whose deflections follow from commands
    joints: tuple[Sequence[str], tuple[int, ...]] = ((), ())  # the last message's names, and our joints among them
    accepted: dict[str, int] = field(default_factory=lambda: dict.fromkeys((IMU, AIR_DATA, ACTUATORS), 0))
    rejected: Rejected = field(default_factory=lambda: {IMU: {}, AIR_DATA: {}, ACTUATORS: {}})


def init(aircraft: Aircraft, max_gap: float, carried: str = "positions") -> AlignmentState:
    """An alignment that has seen nothing; ``max_gap`` (s): the longest spacing that is interpolated across.

    ``carried`` says what the topic ``actuators`` carries.
    """
    actuation = Actuation.of(aircraft)
    errors = StatedErrors.of(aircraft)
    state = AlignmentState(actuation, aircraft.reference.air_density, gap_ns(max_gap), buffer_ns(max_gap), errors)
    state.air_data.late, state.actuators.late = errors.air_data_late, errors.actuators_late
    state.joints = ((), actuation.places(()))
    state.commands = commands_of(aircraft, carried)
    return state


def on_imu(state: AlignmentState, stamp_ns: int, values: Values) -> list[AlignedSample]:
    """Takes ax ay az (m/s^2) p q r (rad/s), FRD; returns the samples that are now complete.

    Never raises for any numbers.
    """
    imu = state.imu
    fault = imu_fault(values) or imu.clock.fault(stamp_ns)
    if fault is not None:
        refuse(state, IMU, fault)
        return []
    state.accepted[IMU] += 1
    epoch, waiting = imu.clock.epoch, imu.waiting
    if not imu.bases or imu.bases[-1].epoch != epoch:
        imu.bases.append(_Base(epoch, imu.since + state.gap + BREAK_NS if epoch else 0, stamp_ns))
    base = imu.bases[-1]
    imu.since = base.since + (stamp_ns - base.stamp)
    waiting.append(_Waiting(epoch, stamp_ns, imu.since, state.errors.imu(values)))
    # where another of this epoch waits already, it waits for another topic, and still does
    waits = len(waiting) > 1 and waiting[-2].epoch == epoch
    complete = [] if waits else _release(state)
    while waiting and imu.since - waiting[0].since > state.buffer:
        _give_up(state)
        complete += _release(state)
    return complete


def on_air_data(state: AlignmentState, stamp_ns: int, values: Values) -> list[AlignedSample]:
    """Takes V (m/s), alpha, beta (rad), rho (kg/m^3); NaN = not measured. Returns as ``on_imu`` does.

    The angle of attack and the sideslip may be NaN, and are then NaN in the samples; where the density is, the aircraft
    file's stands in.
    """
    fault = air_data_fault(values)
    V, alpha, beta, rho = values
    known = state.errors.air_data((V, alpha, beta, state.air_density if is_nan(rho) else rho))
    return _on_neighbour(state, state.air_data, stamp_ns, fault or known)


def on_actuators(
    state: AlignmentState, stamp_ns: int, names: Sequence[str], positions: Sequence[float]
) -> list[AlignedSample]:
    """Takes joint positions (rad; throttle 0..1 or N) by name. Returns as ``on_imu`` does.

    Joints that the aircraft file does not name are ignored; without its throttle joint the thrust is NaN.
    """
    known, places = state.joints
    if names != known:
        places = state.actuation.places(names)
        state.joints = (copy(names), places)
    values = state.actuation.of_message(places, positions)
    return _on_neighbour(state, state.actuators, stamp_ns, values, state.commands)


def stamp_of(state: AlignmentState, time: float) -> int:
    """The header stamp, in ns, of the IMU message whose sample has this time; for samples just returned."""
    since = round(time * 1e9)
    base = next(base for base in reversed(state.imu.bases) if base.since <= since)
    return base.stamp + since - base.since


def go_on_from(state: AlignmentState, first: int, last: int, waiting: Sequence[int], values: Sequence[Values]) -> None:
    """Put a fresh alignment where IMU messages from ``first`` to ``last`` (ns) brought it.

    ``waiting`` are the stamps of the last of them that no sample has been made of, ``values`` what they hold.
    """
    state.imu.clock.last, state.imu.since = last, last - first
    state.imu.bases.append(_Base(0, 0, first))
    state.imu.waiting.extend(
        _Waiting(0, *each) for each in zip(waiting, (t - first for t in waiting), values, strict=True)
    )


def go_on_after(state: AlignmentState, topic: str, stamps: Sequence[int], values: Sequence[Values]) -> None:
    """Put a fresh alignment where the last messages of a topic with neighbours brought it.

    ``stamps`` (ns) and ``values`` are without the stated errors.
    """
    neighbours = state.air_data if topic == AIR_DATA else state.actuators
    before = [*stamps[:1], *stamps[:-1]]
    spans = (min(now - last, state.gap) for now, last in zip(stamps, before, strict=True))
    entries = [_Entry(0, *each) for each in zip(stamps, spans, values, strict=True)]
    if entries:
        horizon = stamps[-1] - KEPT_BUFFERS * state.buffer
        neighbours.entries.extend(entry for entry in entries if entry.stamp >= horizon)
        neighbours.newest, neighbours.clock.last = entries[-1], stamps[-1] + neighbours.late


def _on_neighbour(
    state: AlignmentState,
    topic: _Neighbours,
    stamp: int,
    values: Values | str,
    commands: RecordedCommands | None = None,
) -> list[AlignedSample]:
    """Takes a message of a topic with neighbours, or the reason why not; ``commands`` are told of it."""
    fault = values if isinstance(values, str) else topic.clock.fault(stamp)
    if fault is not None or isinstance(values, str):
        refuse(state, topic.topic, str(fault))
        return []
    state.accepted[topic.topic] += 1
    stamp -= topic.late
    entries, epoch = topic.entries, topic.clock.epoch
    before = topic.newest if topic.newest is not None and topic.newest.epoch == epoch else None
    topic.newest = _Entry(epoch, stamp, min(stamp - before.stamp, state.gap) if before else 0, values)
    entries.append(topic.newest)
    if commands is not None:
        take_command(commands, epoch, stamp, values)
    horizon = stamp - KEPT_BUFFERS * state.buffer
    while entries[0].epoch < epoch - 1 or (entries[0].epoch == epoch and entries[0].stamp < horizon):
        entries.popleft()
    return _release(state)


def _release(state: AlignmentState) -> list[AlignedSample]:
    """The samples whose neighbours have come, in order; counts those that have none close enough."""
    complete: list[AlignedSample] = []
    waiting = state.imu.waiting
    while waiting:
        imu = waiting[0]
        air_data = _neighbours_of(state, state.air_data, imu)
        if air_data is _Missing.AS_YET:
            break
        actuators = _neighbours_of(state, state.actuators, imu)
        if actuators is _Missing.AS_YET:
            break
        waiting.popleft()
        if air_data is _Missing.FOR_GOOD:
            refuse(state, IMU, gap(AIR_DATA))
        elif actuators is _Missing.FOR_GOOD:
            refuse(state, IMU, gap(ACTUATORS))
        else:
            complete.append(_completed(state, imu, air_data, actuators))
    return complete


def _completed(state: AlignmentState, imu: _Waiting, air_data: _Pair, actuators: _Pair) -> AlignedSample:
    """The IMU message with what the other topics say at its stamp."""
    left, right = actuators[0], air_data[1]
    commands = state.commands
    if commands is not None and follows(commands, left.epoch, imu.stamp):
        state.commands_from = min(state.commands_from, imu.since / 1e9)
        thrust, *controls = deflections(commands, left.epoch, imu.stamp, left.values)
    else:
        thrust, *controls = _interpolated(actuators, imu.stamp)
    sample = (*imu.values, *_interpolated(air_data, imu.stamp), thrust, right.interval / 1e9, *controls)
    wait = (max(right.stamp, actuators[1].stamp) - imu.stamp) / 1e9
    return AlignedSample(imu.since / 1e9, sample, wait)


def _interpolated(pair: _Pair, stamp: int) -> Sequence[float]:
    """Values at a stamp on the straight line between two messages."""
    left, right = pair
    if left is right:
        return left.values
    weight = (stamp - left.stamp) / (right.stamp - left.stamp)
    return [a + weight * (b - a) for a, b in zip(left.values, right.values, strict=True)]


def _give_up(state: AlignmentState) -> None:
    """Leaves out the IMU message that has waited longest, and takes it that the topics' clocks are set apart."""
    imu = state.imu.waiting.popleft()
    missing = isinstance(_neighbours_of(state, state.air_data, imu), _Missing)
    refuse(state, IMU, gap(AIR_DATA if missing else ACTUATORS))
    for topic in (state.air_data, state.actuators):
        topic.ahead = topic.clock.epoch - state.imu.clock.epoch


def _neighbours_of(state: AlignmentState, topic: _Neighbours, imu: _Waiting) -> _Pair | _Missing:
    """A topic's messages on both sides of an IMU message's stamp, or why there are none.

    A message of the same stamp stands on both sides. Forgets messages that are no longer needed.
    """
    entries, epoch, stamp = topic.entries, imu.epoch + topic.ahead, imu.stamp
    newest = topic.newest
    if newest is not None and newest.stamp < stamp and newest.epoch == epoch:
        return _Missing.AS_YET
    while entries and entries[0].epoch < epoch:
        entries.popleft()
    while len(entries) > 1 and entries[1].epoch == epoch and entries[1].stamp <= stamp:
        entries.popleft()
    left = entries[0] if entries and entries[0].epoch == epoch else None
    if left is not None and left.stamp == stamp:
        return left, left
    if left is not None and left.stamp > stamp:
        return _Missing.FOR_GOOD
    right = entries[1] if len(entries) > 1 and entries[1].epoch == epoch else None
    if left is None or right is None:
        both_set = topic.clock.epoch > epoch and state.imu.clock.epoch > imu.epoch
        return _Missing.FOR_GOOD if both_set else _Missing.AS_YET
    return (left, right) if right.stamp - left.stamp <= state.gap else _Missing.FOR_GOOD


def refuse(state: AlignmentState, topic: str, reason: str) -> None:
    """Counts a message that is left out."""
    reasons = state.rejected[topic]
    reasons[reason] = reasons.get(reason, 0) + 1
