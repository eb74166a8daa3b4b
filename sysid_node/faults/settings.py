"""Settings of the fault monitor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from sysid_node.errors import InputError

#: Allowed values, both ends included.
RANGES: Mapping[str, tuple[float, float]] = {
    "false_alarms": (1e-6, 10.0),
    "learning": (5.0, 600.0),
    "memory": (10.0, 3600.0),
    "slack": (0.0, 0.5),
    "actuator_lag": (0.005, 1.0),
    "servo_error": (0.005, 1.0),
}
TESTS_AN_HOUR = 36000.0 * 40.0  # blocks in an hour, times hypotheses and spans


@dataclass(frozen=True)
class FaultMonitorSettings:
    """Settings of the monitor; defaults suit UAVs of 1 to 20 kg. Raises InputError on impossible values."""

    false_alarms: float = 0.02  # 1/h, expected number of false alarms by chance
    learning: float = 20.0  # s at the start in which no fault is reported
    memory: float = 60.0  # s, time constant of the residuals' autocorrelation estimate
    slack: float = 0.03  # change of each derivative, as a share, that is no fault, as no model is exact
    actuator_lag: float = 0.05  # s, first-order, of the surfaces behind their commands
    servo_error: float = 0.035  # rad between a surface and where its command should have taken it

    def __post_init__(self) -> None:
        for name, (lower, upper) in RANGES.items():
            value = getattr(self, name)
            if not lower <= value <= upper:
                raise InputError(f"setting {name} = {value!r}: expected {lower:g} to {upper:g}")

    @property
    def threshold(self) -> float:
        """Logarithm of the Bayes factor above which a fault is reported.

        Without a fault a Bayes factor exceeds K with a probability of at most 1/K (Markov's inequality).
        """
        return math.log(TESTS_AN_HOUR / self.false_alarms)
