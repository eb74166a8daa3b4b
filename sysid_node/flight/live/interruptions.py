"""Whether the samples come in parts that are too short to estimate from.

Nothing is known of the time between two samples that are further apart than ``max_gap``. Estimates are therefore made
of the parts between such interruptions, and every part loses some of what it tells to its unknown ends. In a simulated
flight of 50 s with 21 valid derivatives, a quarter of a second was left out again and again: every 5 s it left all of
them valid, every 4 s 15, every 3 s 7, and every 2 s or more often none.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from sysid_node.flight.record import Array

LONG = 4.0  # s: where all parts are shorter, few estimates become valid or none
WINDOW = 20.0  # s that are looked back upon
LASTED = 10.0  # s of such parts, from which on they are told
FEWEST = 3  # interruptions that are told
_BRIDGED = 0.5  # s: over longer interruptions nothing should be interpolated


@dataclass
class Interruptions:
    """The interruptions of samples that come one at a time; times in s."""

    began: float = 0.0  # the part that is under way
    parts: deque[tuple[float, float, float]] = field(default_factory=deque)  # begin, end, and the pause after it
    count: int = 0  # since the first sample
    first: float | None = None  # the first sample
    longest: float = 0.0  # finished part since then
    pause: float = 0.0  # the longest since then

    def add(self, before: float | None, after: float) -> None:
        """A part begins at ``after``; the sample before that was at ``before``, or there was none."""
        if before is None:
            self.first = after
        else:
            self.parts.append((self.began, before, after - before))
            self.count += 1
            self.longest, self.pause = max(self.longest, before - self.began), max(self.pause, after - before)
        self.began = after
        self._forget(after)

    def add_samples(self, last: float, times: Array, max_gap: float) -> None:
        """Samples (N,) in order, of which those more than ``max_gap`` apart are interrupted.

        ``last``: the last sample before these, NaN where these are the first.
        """
        every = np.concatenate([[last], times])
        for i in np.flatnonzero(~(np.diff(every) <= max_gap)):
            self.add(None if np.isnan(every[i]) else float(every[i]), float(every[i + 1]))

    def _forget(self, now: float) -> None:
        while self.parts and self.parts[0][1] < now - WINDOW:
            self.parts.popleft()

    def recent_fault(self, now: float, max_gap: float) -> str:
        """What is wrong with the last ``WINDOW`` s before the last sample (s), in words; empty where nothing is."""
        self._forget(now)
        if len(self.parts) < FEWEST or now - self.parts[0][0] < LASTED:
            return ""
        longest = max(now - self.began, *(end - begin for begin, end, _ in self.parts))
        pause = max(pause for *_, pause in self.parts)
        return _words(len(self.parts), now - self.parts[0][0], longest, pause, max_gap)

    def fault(self, now: float, max_gap: float) -> str:
        """The same of the whole flight until the last sample."""
        if self.count < FEWEST or self.first is None:
            return ""
        return _words(self.count, now - self.first, max(self.longest, now - self.began), self.pause, max_gap)


def _words(count: int, seconds: float, longest: float, pause: float, max_gap: float) -> str:
    if longest >= LONG:
        return ""
    text = (
        f"{count} interruptions of up to {pause:.2f} s in {seconds:.0f} s, and no longer part without one than "
        f"{longest:.1f} s: estimates need {LONG:g} s or more; find out why messages are missing"
    )
    bridged = f", or set max_gap ({max_gap:g} s) to more than {pause:.2f} s"
    return text + bridged if pause <= _BRIDGED else text
