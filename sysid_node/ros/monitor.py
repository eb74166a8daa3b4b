"""What a node observes of its own work: arrivals by topic, times taken."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field


@dataclass
class TopicMonitor:
    """Arrivals of one topic, by a clock that never jumps; ``rate`` is over the time since it was last asked for."""

    name: str
    received: int = 0
    last: float = float("nan")  # s, time.monotonic of the last message
    _counted: int = 0
    _since: float = field(default_factory=time.monotonic)

    def arrived(self) -> None:
        """One more message."""
        self.received += 1
        self.last = time.monotonic()

    def silence(self) -> float:
        """Seconds since the last message, NaN where there was none."""
        return time.monotonic() - self.last

    def rate(self) -> float:
        """Messages per second since the last call."""
        now = time.monotonic()
        rate = (self.received - self._counted) / max(now - self._since, 1e-9)
        self._counted, self._since = self.received, now
        return rate


@dataclass
class Durations:
    """The last so many durations of one kind of work."""

    seconds: deque[float] = field(default_factory=lambda: deque(maxlen=500))

    def add(self, seconds: float) -> None:
        """One more, s."""
        self.seconds.append(seconds)

    def percentiles(self) -> tuple[float, float]:
        """p50 and p99, s; NaN where there are none."""
        if not self.seconds:
            return float("nan"), float("nan")
        ordered = sorted(self.seconds)
        return ordered[len(ordered) // 2], ordered[len(ordered) * 99 // 100]
