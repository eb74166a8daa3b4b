"""Deflections from commands, by the servos' times as the identifier estimates them.

The identifier's derivatives belong to deflections that follow the commands with these times. With the commands
themselves in place of the deflections, every fast manoeuvre would contradict them. A servo is of first order here.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sysid_node.aircraft.model import Aircraft
from sysid_node.faults.model.reference_model import RIPE, IdentifierEstimate
from sysid_node.online.systematic.servo_states import SHORTEST, ServoStates
from sysid_node.online.types import SAMPLE_COLUMNS

_FIRST = len(SAMPLE_COLUMNS)


@dataclass
class ServoFollower:
    """Where the servos of the aircraft's controls are, in the order of its file."""

    names: tuple[str, ...]
    states: ServoStates
    pending: deque[tuple[float, Mapping[str, IdentifierEstimate]]] = field(default_factory=deque)


def init(aircraft: Aircraft) -> ServoFollower:
    """Servos that are where they are told to be, until the identifier says otherwise."""
    names = tuple(aircraft.controls)
    return ServoFollower(names, ServoStates([0.0] * len(names)))


def receive_estimates(follower: ServoFollower, time: float, servos: Mapping[str, IdentifierEstimate]) -> None:
    """Take the servos' times (s) at a time (s)."""
    if follower.pending and time < follower.pending[-1][0]:
        follower.pending.clear()  # the clock has stepped back
    if not follower.pending or time - follower.pending[-1][0] >= RIPE:
        follower.pending.append((time, servos))


def deflected(
    follower: ServoFollower, time: float, sample: Sequence[float], *, learning: bool = False
) -> Sequence[float]:
    """The sample (``SAMPLE_COLUMNS``, then controls) at ``time`` (s) with deflections in place of commands.

    Like the derivatives, the servos' times are adopted when they are 10 s old; while the monitor is ``learning`` what
    sound flight is like, at once, because it judges nothing then.
    """
    while follower.pending and (learning or time - follower.pending[0][0] >= RIPE):
        _adopt(follower, follower.pending.popleft()[1])
    end = _FIRST + len(follower.names)
    controls = list(sample[_FIRST:end])
    if not math.isfinite(math.fsum(controls)):
        return sample
    follower.states.follow(time, controls)
    if max(follower.states.lateness, default=0.0) < SHORTEST:
        return sample
    return [*sample[:_FIRST], *follower.states.positions, *sample[end:]]


def _adopt(follower: ServoFollower, servos: Mapping[str, IdentifierEstimate]) -> None:
    late = list(follower.states.lateness)
    for i, name in enumerate(follower.names):
        known = servos.get(name)
        if known is not None and known.valid and math.isfinite(known.value):
            late[i] = max(known.value, 0.0)
    if late != follower.states.lateness:
        follower.states = follower.states.moved(late)
