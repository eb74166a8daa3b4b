"""Compares how late each servo is after a change of the aircraft with how late it was before.

A servo that becomes slower changes the response to commands. The identifier announces a change of the aircraft, forgets
the data from before it, and estimates how late each servo is anew. Two estimates from different data whose difference
is many times its standard error are a change of that servo. Both are estimated with the same unknown delays of the
instruments, so that the standard error of the difference is rather too large than too small. Without an announced
change nothing is compared: the estimates of a flight move by more than their errors say when its motion changes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from sysid_node.faults.model.reference_model import IdentifierEstimate
from sysid_node.faults.types import ESTIMATES, SLOWER, Fault

SURE = 4.0  # standard errors of the difference: false in 3 of 100,000 comparisons
LEAST = 0.015  # s, and
LEAST_SHARE = 0.3  # as a share of the time before: a smaller difference is of no interest
LASTING = 1.0  # s for which the estimates must differ
BEFORE = 2.0  # s before an announced change whose estimates may already have changed
WIDE = 1.96  # standard errors of a 95 % interval


class ServoTime(NamedTuple):
    """How late a servo follows its command (s), and when (s) this was estimated."""

    value: float
    error: float
    time: float


@dataclass
class ServoTimes:
    """The state of the comparison, by control."""

    recent: dict[str, list[ServoTime]] = field(default_factory=dict)  # of the last ``BEFORE`` s, and one before them
    before: dict[str, ServoTime] = field(default_factory=dict)  # the last change; empty until the first
    differs: dict[str, float] = field(default_factory=dict)  # s, of the first estimate that is slower
    found: dict[str, Fault] = field(default_factory=dict)
    announced: bool = False  # whether the last estimates announced a change

    @property
    def faults(self) -> list[Fault]:
        """The servos that are slower than before the last change."""
        return list(self.found.values())


def receive(state: ServoTimes, time: float, servos: Mapping[str, IdentifierEstimate], changed: bool) -> None:
    """Take the identifier's estimates of how late each control's servo is (s), at a time (s, as the samples').

    ``changed``: whether the identifier announces a change of the aircraft with them.
    """
    if changed and not state.announced:
        _forget(state)
    state.announced = changed
    for name, (value, error, valid) in servos.items():
        if valid and math.isfinite(value) and 0.0 < error < math.inf:
            now = ServoTime(value, error, time)
            _compare(state, name, now)
            past = state.recent.setdefault(name, [])
            past.append(now)
            while len(past) > 1 and past[1].time <= time - BEFORE:
                past.pop(0)


def _forget(state: ServoTimes) -> None:
    """Compare with the estimates before now from here on; with those before a fault that is present."""
    latest = {name: past[0] for name, past in state.recent.items()}
    state.before = latest | {name: state.before[name] for name in state.found}
    state.recent.clear()
    state.differs.clear()


def _compare(state: ServoTimes, name: str, now: ServoTime) -> None:
    before = state.before.get(name)
    if before is None:
        return
    difference, error = now.value - before.value, math.hypot(now.error, before.error)
    if difference <= max(SURE * error, LEAST, LEAST_SHARE * before.value):
        state.differs.pop(name, None)
        state.found.pop(name, None)
        return
    since = state.differs.setdefault(name, now.time)
    known = state.found.get(name)
    if known or now.time - since >= LASTING:
        ends = (difference - WIDE * error, difference + WIDE * error)
        sure = 0.5 * (1.0 + math.erf(difference / error / math.sqrt(2.0)))
        found = known.found if known else now.time
        state.found[name] = Fault(SLOWER, name, difference, *ends, "s", before.time, found, sure, source=ESTIMATES)
