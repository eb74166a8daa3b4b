"""How many samples a simulator in real time flies next: what the clock on the wall asks for, never much of it at once.

A process that was not given the processor is late. Flown in one go, what is late would be flown blindly, as commands
are only heard in between: a tenth of a second of it is enough to lose a small aircraft. So it is made up for in small
pieces, and what is late by more than that is not flown at all: the flight goes slower than the clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

MOST_BEHIND = 0.2  # s, of the clock on the wall; what is late beyond it is not flown
AT_ONCE = 0.02  # s of flight, after which commands are heard again


@dataclass
class Pace:
    """From ``begun`` (s) on, samples of ``step`` s, ``speed`` times as fast as the clock."""

    begun: float
    step: float
    speed: float = 1.0
    skipped: float = 0.0  # s of flight that were not flown
    behind: float = 0.0  # s, the most by which the clock on the wall was ahead since it was last told

    def due(self, now: float, flown: int) -> int:
        """How many samples to fly at a time (s), after so many."""
        late = (now - self.begun) * self.speed - self.skipped - flown * self.step
        self.behind = max(self.behind, late / self.speed)
        lost = max(late - MOST_BEHIND * self.speed, 0.0)
        self.skipped += lost
        return max(math.ceil(min(late - lost, AT_ONCE) / self.step - 1e-9), 0)

    def tell(self) -> float:
        """How far it was behind (s) at most since this was last asked."""
        behind, self.behind = self.behind, 0.0
        return behind
