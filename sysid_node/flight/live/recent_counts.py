"""Messages that came and were rejected within the last seconds: what is wrong now, not what once was."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from sysid_node.flight.checks import CLOCK_STEP
from sysid_node.flight.live.monitor import TopicMonitor

WINDOW = 10.0  # s
ALL, FEW = 0.9, 0.01  # shares of a topic's messages: as good as all, and so few that they are no trouble
STRAY = 2  # messages that are no trouble: when topics begin, the first has no neighbour in the others


class RecentTopic(NamedTuple):
    """What came on a topic within the window."""

    topic: str
    received: int
    rejected: Mapping[str, int]  # by reason

    @property
    def share(self) -> float:
        """The share of messages that were rejected."""
        return sum(self.rejected.values()) / max(self.received, 1)

    @property
    def troubled(self) -> bool:
        """Whether so many were rejected that something is wrong, or the clock was set."""
        return CLOCK_STEP in self.rejected or (self.share > FEW and sum(self.rejected.values()) > STRAY)

    @property
    def most(self) -> str:
        """The most frequent reason."""
        return max(self.rejected, key=lambda reason: self.rejected[reason])


@dataclass
class RecentCounts:
    """Counts within the last ``WINDOW`` s, from those since the start. ``clock`` never jumps."""

    clock: Callable[[], float] = time.monotonic  # s
    _kept: deque[tuple[float, dict[str, int], dict[str, int]]] = field(default_factory=deque)

    def __post_init__(self) -> None:
        self._kept.append((self.clock(), {}, {}))

    def update(self, topics: Sequence[TopicMonitor], rejected: Mapping[str, int]) -> list[RecentTopic]:
        """The recent counts, given all messages received and rejected so far (``"<topic>: <reason>"`` -> count)."""
        now = self.clock()
        received = {topic.name: topic.received for topic in topics}
        self._kept.append((now, received, dict(rejected)))
        while len(self._kept) > 1 and self._kept[1][0] <= now - WINDOW:
            self._kept.popleft()
        if any(rejected.get(reason, 0) < count for reason, count in self._kept[0][2].items()):
            self._kept = deque([(now, received, {})])  # a reset forgets what was rejected
        first = self._kept[0]
        return [
            RecentTopic(
                name,
                count - first[1].get(name, 0),
                {
                    reason.removeprefix(f"{name}: "): more
                    for reason, total in rejected.items()
                    if reason.startswith(f"{name}: ") and (more := total - first[2].get(reason, 0)) > 0
                },
            )
            for name, count in received.items()
        ]
