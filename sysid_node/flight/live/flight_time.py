"""Seconds of flight by the stamps of a topic, which go on where the clock that stamps them is set."""

from __future__ import annotations

import math
from dataclasses import dataclass

NANOSECONDS = 1_000_000_000
LONGEST_STEP = 1.0  # s between two stamps, beyond which the clock was set, or the topic was silent


@dataclass
class FlightTime:
    """A time (s) that never goes back, and does not leap."""

    seconds: float = 0.0
    _stamp: int | None = None  # ns, the newest

    def arrived(self, stamp_ns: int) -> bool:
        """Take the stamp of a message. False where the message is not newer than the one before it.

        A step of the stamps by more than ``LONGEST_STEP``, to either side, adds nothing.
        """
        step = math.inf if self._stamp is None else (stamp_ns - self._stamp) / NANOSECONDS
        if -LONGEST_STEP <= step <= 0.0:
            return False
        self._stamp = stamp_ns
        self.seconds += step if 0.0 < step <= LONGEST_STEP else 0.0
        return True
