"""Faults, as the fault monitor reports them. SI units, radians."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

#: Kinds of faults: seven of a surface, four of a sensor, one of the airframe.
LOSS, STUCK, HARD_OVER, SHIFTED = "loss of effectiveness", "stuck surface", "hard-over", "surface shifted"
NOT_FOLLOWING, SLOWER, RATE_LIMITED = "surface does not follow", "servo slower", "servo at its rate limit"
AIRSPEED, VANE_OFFSET, VANE_STUCK, SILENT = "airspeed wrong", "vane offset", "vane stuck", "sensor silent"
DAMAGE = "structural damage"
#: The evidence by which a fault was found.
FORCES, POSITION, ARRIVAL, ESTIMATES = "forces", "position", "arrival", "estimates"


class DerivativeChange(NamedTuple):
    """The change of a derivative, with its 95 % interval."""

    name: str
    value: float
    lower: float
    upper: float


@dataclass(frozen=True)
class Fault:
    """A fault: its kind, part, size, onset (s of the samples' time) and probability."""

    kind: str
    part: str  # elevator; airspeed, alpha, beta; longitudinal, lateral
    size: float  # see ``unit``
    lower: float  # 95 % interval of the size; NaN where there is none
    upper: float
    unit: str
    since: float
    found: float  # s, when it was found
    probability: float  # among all hypotheses
    changes: tuple[
        DerivativeChange, ...
    ] = ()  # for damage: the derivatives with a significant change, most significant first
    source: str = FORCES

    @property
    def text(self) -> str:
        """The fault in one line."""
        words = f"{self.part}: {self.kind}"
        if not math.isnan(self.size):
            words += f", {amount(self.size, self.unit)}"
        if not math.isnan(self.lower):
            words += f" ({amount(self.lower, self.unit)} to {amount(self.upper, self.unit)})"
        if self.changes:
            words += ", changes: " + ", ".join(f"{c.name} {c.value:+.3g}" for c in self.changes[:3])
        return words

    def values(self, now: float) -> dict[str, str]:
        """All values as texts for a diagnostic_msgs/DiagnosticStatus, at a time (s, as ``since``)."""
        found: dict[str, object] = {"kind": self.kind, "part": self.part, "size": self.size}
        found |= {"lower": self.lower, "upper": self.upper, "unit": self.unit, "probability": self.probability}
        times = {"onset": self.since, "found": self.found, "now": now}
        found |= {f"{name} (s since the first IMU message)": time for name, time in times.items()}
        found |= {c.name: f"{c.value:.6g} [{c.lower:.6g}, {c.upper:.6g}]" for c in self.changes}
        return {key: f"{value:.6g}" if isinstance(value, float) else str(value) for key, value in found.items()}


def amount(value: float, unit: str) -> str:
    """A size as text: rad in degrees, a share in per cent."""
    if unit == "rad":
        return f"{math.degrees(value):+.1f} deg"
    return f"{100.0 * value:.0f} %" if unit == "1" else f"{value:.3g} {unit}".strip()
