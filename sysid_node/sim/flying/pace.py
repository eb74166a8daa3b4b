"""How many samples a simulator in real time flies next.

A process that has waited for the processor is late. Commands are read only between calls, so that a delay made up in
one call would be flown without any; a tenth of a second of this is enough to lose a small aircraft. A delay is
therefore made up in short pieces, and a delay beyond ``MOST_BEHIND`` is skipped: the flight is then slower than the
clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

MOST_BEHIND = 0.2  # s of the real clock; a delay beyond it is skipped
AT_ONCE = 0.02  # s of flight, after which commands are read again


@dataclass
class Pace:
    """Samples of ``step`` s, flown from ``begun`` (s) on, ``speed`` times as fast as the real clock."""

    begun: float
    step: float
    speed: float = 1.0
    skipped: float = 0.0  # s of flight that were skipped
    behind: float = 0.0  # s, largest delay behind the real clock since ``tell`` was last called

    def due(self, now: float, flown: int) -> int:
        """How many samples to fly at the time ``now`` (s), after ``flown`` samples."""
        late = (now - self.begun) * self.speed - self.skipped - flown * self.step
        self.behind = max(self.behind, late / self.speed)
        lost = max(late - MOST_BEHIND * self.speed, 0.0)
        self.skipped += lost
        return max(math.ceil(min(late - lost, AT_ONCE) / self.step - 1e-9), 0)

    def tell(self) -> float:
        """The largest delay (s) since the last call."""
        behind, self.behind = self.behind, 0.0
        return behind
