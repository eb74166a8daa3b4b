"""Whether the topic ``actuators`` carries commands or positions, told from the messages themselves.

A command may jump from one message to the next and stay there. A surface does not: a servo of first order with the time
constant T, having moved by d within a period h, moves on by d exp(-h / T) within the next. Hobby servos have time
constants of 20 to 120 ms, and turn by 60 degrees in 0.1 to 0.2 s. A change that is at least ``ISOLATED`` times as large
as those before and after it is therefore a command's, where it comes soon after the message before (``LONGEST_PERIOD``:
a servo that moves like this has a time constant under 12 ms). Where it does not, the surface would have to be faster
than ``FASTEST``, too. Smooth inputs such as multisines tell nothing; they are then taken as positions.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import Array
from sysid_node.flight.servos import Servo, ServoState, give, in_words, move, servos_of
from sysid_node.flight.streams import Stamps

#: What the topic carries, as users state it.
CARRIED = ("auto", "commands", "positions")

ISOLATED = 8.0  # times the changes before and after it
AROUND = 2  # as many changes on either side must be small: noise seldom has that
SMALLEST = 0.01  # rad: larger than what quantisation and feedback of noise move
LONGEST_PERIOD = 25_000_000  # ns: over which the change itself may have come
FASTEST = 15.0  # rad/s: 60 degrees in 0.07 s, faster than hobby servos
NEEDED = 2  # such changes: a single one may be a fault of a position sensor


@dataclass(slots=True)
class JumpCounter:
    """The last changes of the controls, and how many of all changes were those of a command."""

    stamp: int = 0  # ns, of the last message
    values: Sequence[float] = ()  # rad, of the last message; empty = none has come yet
    changes: deque[list[float]] = field(default_factory=lambda: deque(maxlen=2 * AROUND + 1))  # rad, absolute
    periods: deque[int] = field(default_factory=lambda: deque(maxlen=2 * AROUND + 1))  # ns, of each change
    jumps: int = 0

    @property
    def commanded(self) -> bool:
        """Whether the messages so far tell that they are commands."""
        return self.jumps >= NEEDED


def take(counter: JumpCounter, stamp: int, controls: Sequence[float]) -> None:
    """Take the controls (rad) of the next message, stamped at ``stamp`` (ns)."""
    changes, periods = counter.changes, counter.periods
    if counter.values:
        changes.append([abs(a - b) for a, b in zip(controls, counter.values, strict=True)])
        periods.append(stamp - counter.stamp)
        if len(changes) > 2 * AROUND and any(map(_is_jump, *changes)):
            period = periods[AROUND]
            counter.jumps += period <= LONGEST_PERIOD or max(changes[AROUND]) > FASTEST * period / 1e9
    counter.stamp, counter.values = stamp, controls


def _is_jump(*changes: float) -> bool:
    """Whether the middle one of these changes (rad) stands out."""
    least = changes[AROUND] / ISOLATED
    return changes[AROUND] > SMALLEST and all(x < least for i, x in enumerate(changes) if i != AROUND)


def known_from(stamps: Stamps, controls: Array) -> int | None:
    """The place of the message (N,) with which the controls (N, m) are known as commands; None where they are not.

    The decision of ``take``, message after message.
    """
    period, changes = np.diff(stamps), np.abs(np.diff(controls, axis=0))
    count = len(changes) - 2 * AROUND
    if count < 1:
        return None
    middle = slice(AROUND, AROUND + count)
    least = changes[middle] / ISOLATED
    jump = changes[middle] > SMALLEST
    for i in (i for i in range(2 * AROUND + 1) if i != AROUND):
        jump &= changes[i : i + count] < least
    periods = period[middle]
    fastest = FASTEST * periods / 1e9
    is_command_step = jump.any(axis=1) & ((periods <= LONGEST_PERIOD) | (changes[middle].max(axis=1) > fastest))
    found = np.flatnonzero(is_command_step)
    return int(found[NEEDED - 1]) + 2 * AROUND + 1 if found.size >= NEEDED else None


@dataclass(slots=True)
class RecordedCommands:
    """The commands of a flight and what they make the servos do.

    ``since``: epoch and stamp (ns) after which samples take their deflections from commands; None = from none so far.
    """

    models: tuple[Servo, ...]
    decided: bool  # whether the user said that the topic carries commands
    since: tuple[int, int] | None = None
    epoch: int = -1  # of the servos' states
    servos: tuple[ServoState, ...] = ()
    counter: JumpCounter = field(default_factory=JumpCounter)
    recent: deque[tuple[int, Sequence[float]]] = field(
        default_factory=lambda: deque(maxlen=AROUND + 2)
    )  # stamps, values


def commands_of(aircraft: Aircraft, carried: str, *, servos: bool = True) -> RecordedCommands | None:
    """What follows the commands of an aircraft; None where the topic carries positions.

    Without ``servos`` deflections are the commands themselves, held.
    """
    if carried == "positions":
        return None
    models = servos_of(aircraft) if servos else (Servo(),) * (1 + len(aircraft.controls))
    is_commanded = carried == "commands"
    return RecordedCommands(models, is_commanded, (-1, 0) if is_commanded else None)


def carried_in_words(aircraft: Aircraft, setting: str, commanded: bool, late: Sequence[str] = ()) -> str:
    """A sentence for the reader: what the topic carries, how that is known, and what follows.

    ``late``: controls that surely act later than they are recorded.
    """
    how = " (inferred from the messages)" if setting == "auto" else ""
    if commanded:
        return f"Actuators carry commands{how}; {in_words(aircraft)}."
    if setting == "auto":
        taken = "Actuators are taken as positions: no command jumps that a surface could not follow."
        if late:
            act = "acts" if len(late) == 1 else "act"
            return f"{taken} But {', '.join(late)} {act} later than recorded, as after commands: {_STATE}"
        return f"{taken} {_UNSAID}" if aircraft.ideal else taken
    return ""


#: What users are asked for where messages do not show what they are.
_STATE = "state what they carry (actuators: positions or commands)."

#: Smooth commands look like positions, and an ideal aircraft has no tolerance for the difference.
_UNSAID = f"The aircraft file is ideal, so the intervals hold only if they are: {_STATE}"


def take_command(state: RecordedCommands, epoch: int, stamp: int, values: Sequence[float]) -> None:
    """Take thrust (N) and controls (rad) of the next message, stamped at ``stamp`` (ns) in an epoch of its clock."""
    if epoch != state.epoch:
        state.epoch, state.counter = epoch, JumpCounter(jumps=state.counter.jumps)
        state.recent.clear()
        state.servos = tuple(map(ServoState, state.models)) if state.since is not None else ()
    state.recent.append((stamp, values))
    if state.since is not None:
        _give_all(state, stamp, values)
        return
    take(state.counter, stamp, values[1:])
    if state.counter.commanded:
        state.since = epoch, state.recent[-2][0]  # what lies before may have been aligned already
        state.servos = tuple(map(ServoState, state.models))
        for one, command in state.recent:
            _give_all(state, one, command)


def _give_all(state: RecordedCommands, stamp: int, values: Sequence[float]) -> None:
    for servo, value in zip(state.servos, values, strict=True):
        give(servo, stamp, value)


def follows(state: RecordedCommands, epoch: int, stamp: int) -> bool:
    """Whether the deflections at a stamp (ns) of an epoch follow from commands."""
    return state.since is not None and (epoch, stamp) > state.since


def deflections(state: RecordedCommands, epoch: int, stamp: int, held: Sequence[float]) -> list[float]:
    """Thrust and deflections at ``stamp`` (ns), increasing, then the deflections' excess (``servos.move``).

    Where the servos are already in another epoch of the clock, the last message before it, ``held``, stands in.
    """
    if epoch != state.epoch:
        return [*held, *(0.0 for _ in held[1:])]
    moved = [move(servo, stamp) for servo in state.servos]
    return [*(position for position, _ in moved), *(excess for _, excess in moved[1:])]


def with_excess(stamps: Stamps, rows: Array) -> Array:
    """Deflections (N, m) whose straight lines have the areas that ``rows`` (N, 2m) tell: deflections, then excesses.

    Half of the area that an interval has in excess is given to each of the samples at its ends.
    """
    values, excess = np.hsplit(rows, 2)
    step = np.diff(stamps)[:, None] / 1e9
    share = np.zeros_like(values)
    share[1:] += excess[1:] * step
    share[:-1] += excess[1:] * step
    around = np.zeros((len(values), 1))
    around[1:] += step
    around[:-1] += step
    found: Array = values + share / np.maximum(around, 1e-9)
    return found
