"""Watches the tracking error: one beyond what the control law can mean says that the loop is not what was designed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sysid_node.control.law.reference import ReferenceMotion
from sysid_node.control.types import Measurements

#: s for which the error must be too large until the baseline is flown, and small until estimates may be used again.
PATIENCE, RECOVERY = 0.5, 5.0


@dataclass
class TrackingWatch:
    """Compares pitch and roll with the reference motion; ``largest`` error in rad, times in s."""

    largest: float
    large_since: float = math.nan  # NaN: the error is small
    small_since: float = math.nan  # NaN: the error is large, or was never
    words: str = ""  # the error that is too large, empty where it is not
    lost: bool = False  # whether the baseline must be flown

    def update(self, measured: Measurements, wanted: ReferenceMotion) -> None:
        """Take the motion at ``measured.time`` and the reference that it is compared with."""
        errors = {"pitch": measured.theta - wanted.theta, "roll": measured.phi - wanted.phi}
        errors = {name: abs(error) for name, error in errors.items() if math.isfinite(error)}
        if not errors:
            return
        worst = max(errors, key=lambda name: errors[name])
        if errors[worst] > self.largest:
            self.words = f"{worst} is {errors[worst]:.2f} rad from its reference"
            self.large_since, self.small_since = _since(self.large_since, measured.time), math.nan
            self.lost = self.lost or measured.time - self.large_since >= PATIENCE
            return
        self.words, self.large_since = "", math.nan
        self.small_since = _since(self.small_since, measured.time)
        if measured.time - self.small_since >= RECOVERY:
            self.lost = False


def _since(before: float, now: float) -> float:
    """The time at which a condition began: ``before``, or ``now`` where it has just begun or the clock was set back."""
    return before if before <= now else now
