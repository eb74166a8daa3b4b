"""How the messages of a topic arrive: lost, late, out of order, silent, or with a clock that was set.

Diagnostics once a second are too rare to show what lasts for a tenth of a second. Every problem is therefore counted
when it happens and reported by the next message on ``/diagnostics``.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

STEP_BACK, STEP_AHEAD = 1.0, 5.0  # s: a larger step of the stamps is a clock that was set
SEVERAL = 1.6  # usual intervals between two stamps, beyond which at least one message is missing
KEPT, FEW = 40, 8  # intervals that are remembered; the least number that tells the usual interval
SHARE = 0.05  # share of messages lost, beyond which it is reported
LATE = 0.03  # s of delay beyond the smallest, beyond which it is reported
RECENT = 5.0  # s: delays are compared with the smallest of a period this long and of the period before


@dataclass
class Delays:
    """Delays, arrival less stamp (s), of which the smallest is that of a message that did not wait."""

    smallest: float = math.inf  # in this period
    smallest_before: float = math.inf  # in the period before
    period_start: float = -math.inf  # s, by the clock
    largest: float = 0.0  # beyond the smallest, since the last report

    def add(self, now: float, delay: float) -> None:
        """Compare a delay with the smallest of this period and of the one before; ``now`` (s) is by the clock."""
        if now - self.period_start > RECENT:
            self.smallest, self.smallest_before, self.period_start = math.inf, self.smallest, now
        self.smallest = min(self.smallest, delay)
        self.largest = max(self.largest, delay - min(self.smallest, self.smallest_before))

    def forget(self) -> None:
        """Forget the smallest ones: stamps are by another clock now."""
        self.smallest = self.smallest_before = math.inf


@dataclass
class Arrivals:
    """The arrivals of one topic; ``silent_after`` s without a message count as silence. ``clock`` never jumps."""

    topic: str
    silent_after: float
    clock: Callable[[], float] = time.monotonic  # s
    last_arrival: float = -math.inf  # s, by ``clock``, of the last message that was newer than those before it
    stamp: float = math.nan  # s, the newest
    start: tuple[float, float] = (math.nan, math.nan)  # s, ``clock`` and stamp when the stamps began, or were set
    intervals: deque[float] = field(default_factory=lambda: deque(maxlen=KEPT))  # s between stamps
    delays: Delays = field(default_factory=Delays)
    received: int = 0  # since the last report
    missing: int = 0
    events: list[str] = field(default_factory=list)  # that were not reported yet
    count: int = 0  # of all problems so far

    def arrived(self, stamp: float) -> bool:
        """Take a message with a stamp (s). False where it is not newer than those before it: it ends no silence."""
        now = self.clock()
        step, expected = stamp - self.stamp, self._expected_step(now)
        if -STEP_BACK < step <= 0.0:
            self._add("out of order")
            return False
        if self.silent():
            self._add(f"was silent for {now - self.last_arrival:.1f} s")
        self.last_arrival = now
        if math.isnan(self.start[0]):
            self.start = now, stamp
        if step <= -STEP_BACK or step - expected > STEP_AHEAD:
            self.start = now, stamp
            self._add(f"clock set by {step:+.1f} s")
            self.delays.forget()
        elif 0.0 < step < self.silent_after:  # a silence is said as such, not as messages that are missing
            self._count_missing(step)
        self.stamp, self.received = stamp, self.received + 1
        self.delays.add(now, now - stamp)
        return True

    def silent(self) -> bool:
        """Whether the topic is silent now; never before the first message."""
        return math.isfinite(self.last_arrival) and self.clock() - self.last_arrival > self.silent_after

    def troubles(self) -> list[str]:
        """The problems since the last call, in words."""
        words, self.events = list(dict.fromkeys(self.events)), []
        if self.silent():
            words.append(f"silent for {self.clock() - self.last_arrival:.1f} s")
        share = self.missing / max(self.received + self.missing, 1)
        if share > SHARE:
            words.append(f"{100.0 * share:.0f} % lost")
        if self.delays.largest > LATE:
            words.append(f"up to {1e3 * self.delays.largest:.0f} ms late")
        self.count += share > SHARE or self.delays.largest > LATE
        self.received, self.missing, self.delays.largest = 0, 0, 0.0
        return [f"{self.topic} {problem}" for problem in words]

    def _expected_step(self, now: float) -> float:
        """The step (s) of the stamps since the last message, at the pace at which they have run; 0 where it is unknown.

        A simulation runs faster or slower than the real clock, so that stamps go on at another pace during a silence.
        """
        began, stamp = self.start
        lasted = self.last_arrival - began
        pace = (self.stamp - stamp) / lasted if lasted > 1.0 else 1.0
        expected = pace * (now - self.last_arrival)
        return expected if math.isfinite(expected) else 0.0

    def _add(self, event: str) -> None:
        self.events.append(event)
        self.count += 1

    def _count_missing(self, step: float) -> None:
        """Count the messages that are missing between two stamps.

        The lower quartile of the last intervals is taken as the usual one. It holds while up to three quarters of the
        messages are lost, and a single short interval does not change it.
        """
        self.intervals.append(step)
        if len(self.intervals) >= FEW:
            usual = sorted(self.intervals)[len(self.intervals) // 4]
            self.missing += round(step / usual) - 1 if step > SEVERAL * usual else 0
