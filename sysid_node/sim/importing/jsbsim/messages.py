"""JSBSim's own messages: kept, so that an error can give the last, instead of printed."""

from __future__ import annotations

from collections import deque
from typing import Any


def collect_messages() -> deque[str]:
    """The last messages of JSBSim in this thread; from now on it prints none."""
    import jsbsim  # noqa: PLC0415  # an optional dependency

    class Collector(jsbsim.FGLogger):
        """Joins the parts of each message."""

        def __init__(self) -> None:
            super().__init__()
            self.kept: deque[str] = deque(maxlen=5)
            self._parts: list[str] = []

        def set_level(self, level: Any) -> None:
            self._parts = []

        def message(self, message: str) -> None:
            self._parts.append(message)

        def flush(self) -> None:
            text = " ".join("".join(self._parts).split())
            if text:
                self.kept.append(text)

        def file_location(self, filename: str, line: int) -> None:
            """The place is not kept: it lies in a copy of the model that is soon gone."""

        def format(self, format: Any) -> None:
            """Colours are not kept."""

    collector = Collector()
    jsbsim.set_logger(collector)
    return collector.kept
