"""What a node measures of its own work: the messages of each topic, and durations."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class TopicMonitor:
    """Counts the messages of one topic, by a clock that never jumps."""

    name: str
    clock: Callable[[], float] = time.monotonic  # s
    resolved: str = ""  # the topic's name after remaps and with its namespace; empty: ``name`` is that
    received: int = 0
    last: float = float("nan")  # s, by ``clock``, of the last message
    _counted: int = 0  # messages at the last call of ``rate``
    _since: float = float("nan")  # s, of that call
    _began: float = float("nan")  # s

    def __post_init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Begin to wait for messages: at first, and again where a node had not listened."""
        self._since = self._began = self.clock()

    def arrived(self) -> None:
        """Count one more message."""
        self.received += 1
        self.last = self.clock()

    def silence(self) -> float:
        """Seconds since the last message, NaN where there was none."""
        return self.clock() - max(self.last, self._began) if self.received else float("nan")

    def waited(self) -> float:
        """Seconds since the last message, or since the wait began where that was later."""
        return self.clock() - (max(self.last, self._began) if self.received else self._began)

    def rate(self) -> float:
        """Messages per second since the last call of this method."""
        now = self.clock()
        rate = (self.received - self._counted) / max(now - self._since, 1e-9)
        self._counted, self._since = self.received, now
        return rate


@dataclass
class Durations:
    """The last 500 durations of one kind of work."""

    seconds: deque[float] = field(default_factory=lambda: deque(maxlen=500))

    def add(self, seconds: float) -> None:
        """Add one duration, s."""
        self.seconds.append(seconds)

    def percentiles(self) -> tuple[float, float]:
        """Median and 99th percentile, s; NaN where there are no durations."""
        if not self.seconds:
            return float("nan"), float("nan")
        ordered = sorted(self.seconds)
        return ordered[len(ordered) // 2], ordered[len(ordered) * 99 // 100]
