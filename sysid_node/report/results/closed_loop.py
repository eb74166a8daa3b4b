"""The record of a closed-loop flight: tracking errors, estimates and events."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sysid_node.online.types import DerivativeEstimate

EXCITER, FAULT_MONITOR = "exciter", "fault_monitor"


class Event(NamedTuple):
    """What a node reported, and at which time of the flight (s)."""

    time: float
    node: str
    text: str


@dataclass(frozen=True)
class ClosedLoopFlight:
    """A flight in closed loop; times in s of the flight, angles in rad."""

    aircraft: str
    failure: str  # the effect that began at ``onset``; "" = none
    onset: float
    adapted: bool
    time: Sequence[float]
    errors: Mapping[str, Sequence[float]]  # rad: pitch, roll and sideslip less their commands
    commanded: Mapping[str, Sequence[float]]  # rad: pitch, roll
    estimates: Mapping[str, DerivativeEstimate]
    events: Sequence[Event]
    troubles: Mapping[str, int]  # by topic: how often its messages were reported late, lost or missing

    @property
    def failed(self) -> bool:
        """Whether the failure began within the flight."""
        return bool(self.failure) and bool(self.time) and self.time[-1] >= self.onset

    def rms(self, axis: str, start: float, stop: float) -> float:
        """Root mean square of a tracking error between two times, rad; NaN without data."""
        time, errors = np.asarray(self.time), np.asarray(self.errors[axis])
        chosen = errors[(time >= start) & (time < stop) & np.isfinite(errors)]  # NaN: no IMU data at that time
        return float(np.sqrt(np.mean(chosen**2))) if chosen.size else math.nan

    def spans(self, settled: float) -> list[tuple[str, float, float]]:
        """Names, begins and ends of the parts of the flight, the last from ``settled`` s after the failure."""
        end = self.time[-1] if self.time else 0.0
        if not self.failure or end < self.onset:
            return [("whole flight", 0.0, end)]
        middle = self.onset + settled
        parts = [
            ("before the failure", 0.5 * self.onset, self.onset),
            (f"the first {settled:g} s after it", self.onset, min(middle, end)),
            ("from then on", middle, end),
        ]
        return [(name, start, stop) for name, start, stop in parts if start < stop]

    def summary(self) -> dict[str, Any]:
        """The content of ``summary.json``: errors in rad, null without data."""
        parts = {
            name: {axis: _known(self.rms(axis, start, stop)) for axis in self.errors}
            for name, start, stop in self.spans(10.0)
        }
        derivatives = {
            name: {"value": _known(d.value), "lower": _known(d.lower), "upper": _known(d.upper), "status": d.status}
            for name, d in self.estimates.items()
        }
        events = [{"time": event.time, "node": event.node, "what": event.text} for event in self.events]
        return {
            "aircraft": self.aircraft,
            "failure": self.failure,
            "onset": self.onset,
            "adapted": self.adapted,
            "tracking_error": parts,
            "derivatives": derivatives,
            "events": events,
            "message_troubles": dict(self.troubles),
        }

    @property
    def excited(self) -> list[tuple[float, float]]:
        """Begins and ends (s) of the times in which the exciter moved the surfaces."""
        spans, begun = [], math.nan
        for event in self.events:
            if event.node != EXCITER:
                continue
            if event.text.startswith("begun"):
                begun = event.time
            elif event.text.startswith(("known", "aborted", "stopped")) and math.isfinite(begun):
                spans.append((begun, event.time))
                begun = math.nan
        return [*spans, (begun, self.time[-1])] if math.isfinite(begun) and self.time else spans

    @property
    def alarms(self) -> list[Event]:
        """Events in which the fault monitor reported a fault."""
        return [event for event in self.events if event.node == FAULT_MONITOR and ": " in event.text]


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
