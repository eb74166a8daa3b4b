"""An estimate compared with its prior and its true value."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sysid_node.online.types import DerivativeEstimate, Estimates
from sysid_node.report.results.run_result import Prior

#: Half width of a 95 % interval in standard deviations of a normal distribution.
NORMAL_95 = 1.959964


def half_width(d: DerivativeEstimate) -> float:
    """Half of the 95 % interval; NaN where there is none."""
    return (d.upper - d.lower) / 2


def covers(d: DerivativeEstimate, truth: float) -> bool:
    """Whether the 95 % interval contains the true value."""
    return d.lower <= truth <= d.upper


def agrees(d: DerivativeEstimate, prior: Prior) -> bool:
    """Whether the two 95 % intervals explain the difference of estimate and prior, if their errors are independent."""
    tolerance = 0.0 if math.isnan(prior.tolerance) else NORMAL_95 * prior.tolerance
    return abs(d.value - prior.value) <= math.hypot(half_width(d), tolerance)


def changes(history: Sequence[Estimates], name: str) -> list[float]:
    """Times (s) at which the status of a derivative became ``changed``."""
    states = [(e.time, e.derivatives[name].status.startswith("changed")) for e in history if name in e.derivatives]
    before = [False, *(changed for _, changed in states)]
    return [time for (time, changed), was in zip(states, before, strict=False) if changed and not was]
