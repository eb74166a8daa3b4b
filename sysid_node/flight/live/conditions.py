"""What a node says in its log, and when: conditions as they begin and end, and states as they change.

Messages on /diagnostics are seen only by who looks for them; the log is on the terminal. A condition is therefore said
when it begins, again every ``REPEAT`` s while it lasts, and when it is over; nothing is said more often than that.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

REPEAT = 10.0  # s between two lines about the same condition
LEAST = 0.9  # s between two lines about the same state

_NUMBERS = re.compile(r"[-+]?\d+(\.\d+)?")  # they change all the time, and say nothing new


@dataclass
class Conditions:
    """The conditions that were said. ``clock`` never jumps."""

    clock: Callable[[], float] = time.monotonic  # s
    _said: dict[str, float] = field(default_factory=dict)  # s, when each was last said
    _open: set[str] = field(default_factory=set)  # said, and not yet said to be over

    def update(self, present: Mapping[str, str]) -> list[tuple[bool, str]]:
        """The lines to say now, given the present conditions (subject -> text), and of each whether it is a warning."""
        now = self.clock()
        over = sorted(self._open - present.keys())
        self._open -= set(over)
        lines = [(False, f"{subject}: well again") for subject in over]
        for subject, text in present.items():
            if now - self._said.get(subject, -math.inf) >= REPEAT:
                self._said[subject] = now
                self._open.add(subject)
                lines.append((True, f"{subject}: {text}"))
        return lines


@dataclass
class ReportedStates:
    """The states that were said: what is one thing or another, and never wrong in itself. ``clock`` never jumps."""

    clock: Callable[[], float] = time.monotonic  # s
    _said: dict[str, tuple[float, str]] = field(default_factory=dict)  # s and words

    def update(self, present: Mapping[str, str]) -> list[str]:
        """The lines to say now, given the present states: subject -> text. Numbers alone are no news."""
        now, lines = self.clock(), []
        for subject, text in present.items():
            at, before = self._said.get(subject, (-math.inf, ""))
            words = _NUMBERS.sub("", text)
            if words != before and now - at >= LEAST:
                self._said[subject] = now, words
                lines.append(f"{subject}: {text}")
        return lines
