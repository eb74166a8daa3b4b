"""How a topic's messages arrive: lost, late, out of order, silent, their clock set. What happened is kept until told.

Once a second is too seldom to see what lasts for a tenth of it: every trouble is counted as it happens, and told by the
next ``/diagnostics``.
"""

from __future__ import annotations

import math
import time
from collections import deque
from dataclasses import dataclass, field

STEP_BACK, STEP_AHEAD = 1.0, 5.0  # s of the stamps that are a clock that was set
SEVERAL = 1.6  # usual intervals between two stamps: at least one message is missing
KEPT, FEW = 40, 8  # intervals that are remembered; so many tell what is usual
SHARE = 0.05  # of messages lost, beyond which it is told
LATE = 0.03  # s later than the promptest, beyond which it is told
RECENT = 5.0  # s: the promptest of so many, and of those before, is what later ones are compared with


@dataclass
class Arrivals:
    """Of one topic; ``silent_after`` s without a message are told."""

    topic: str
    silent_after: float
    heard: float = -math.inf  # s, monotonic
    stamp: float = math.nan  # s, the newest
    steps: deque[float] = field(default_factory=lambda: deque(maxlen=KEPT))  # s between stamps
    prompt: float = math.inf  # s, the least of arrival less stamp of late
    before: float = math.inf  # s, that of the time before
    since: float = -math.inf  # s, when "of late" began
    came: int = 0  # of late
    missing: int = 0
    latest: float = 0.0  # s
    events: list[str] = field(default_factory=list)  # not told yet
    count: int = 0  # of all troubles so far

    def arrived(self, stamp: float) -> bool:
        """A message with a stamp (s) has come; False where it is no newer than another."""
        now = time.monotonic()
        if self.silent():
            self._tell(f"was silent for {now - self.heard:.1f} s")
        self.heard = now
        step = stamp - self.stamp
        if -STEP_BACK < step <= 0.0:
            self._tell("out of order")
            return False
        if step <= -STEP_BACK or step > STEP_AHEAD:
            self._tell(f"clock set by {step:+.1f} s")
            self.prompt = self.before = math.inf
        elif step > 0.0:
            self._count(step)
        self.stamp, self.came = stamp, self.came + 1
        if now - self.since > RECENT:
            self.prompt, self.before, self.since = math.inf, self.prompt, now
        self.prompt = min(self.prompt, now - stamp)
        self.latest = max(self.latest, now - stamp - min(self.prompt, self.before))
        return True

    def silent(self) -> bool:
        """Whether it is silent at present; never before the first message."""
        return math.isfinite(self.heard) and time.monotonic() - self.heard > self.silent_after

    def troubles(self) -> list[str]:
        """What was wrong since this was last asked, in words."""
        said, self.events = list(dict.fromkeys(self.events)), []
        if self.silent():
            said.append(f"silent for {time.monotonic() - self.heard:.1f} s")
        share = self.missing / max(self.came + self.missing, 1)
        if share > SHARE:
            said.append(f"{100.0 * share:.0f} % lost")
        if self.latest > LATE:
            said.append(f"up to {1e3 * self.latest:.0f} ms late")
        self.count += share > SHARE or self.latest > LATE
        self.came, self.missing, self.latest = 0, 0, 0.0
        return [f"{self.topic} {words}" for words in said]

    def _tell(self, event: str) -> None:
        self.events.append(event)
        self.count += 1

    def _count(self, step: float) -> None:
        """How many are missing between two stamps.

        The lower quartile of the last intervals is usual: it holds while up to three quarters of the messages are lost,
        and an interval that was short by chance is forgotten.
        """
        self.steps.append(step)
        if len(self.steps) >= FEW:
            usual = sorted(self.steps)[len(self.steps) // 4]
            self.missing += round(step / usual) - 1 if step > SEVERAL * usual else 0
