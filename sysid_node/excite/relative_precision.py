"""How precisely derivatives are known, relative to their size: what the exciter compares with the required accuracy."""

from __future__ import annotations

import math
from collections.abc import Iterable

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.types import DerivativeEstimate

#: The least size that a derivative is given, as a share of its value in the aircraft file: a derivative near zero
#: cannot be known to a percent.
LEAST_SIZE = 0.3


def relative_precision(derivatives: Iterable[DerivativeEstimate], aircraft: Aircraft) -> dict[str, float]:
    """The statistical part of half of each 95 % interval over the derivative's size; infinite where it is not valid.

    More excitation lowers no error that comes from the tolerances of mass, places and servos. Where an estimate does
    not say which part is statistical, all of the interval counts.
    """
    found = {}
    for d in derivatives:
        size = max(abs(d.value), LEAST_SIZE * abs(aircraft.derivatives[d.name].value))
        half = 0.5 * (d.upper - d.lower) * _statistical_share(d)
        found[d.name] = half / size if d.valid and size > 0.0 else math.inf
    return found


def _statistical_share(estimate: DerivativeEstimate) -> float:
    """The statistical part of an estimate's standard error."""
    known = math.isfinite(estimate.statistical_error) and estimate.standard_error > 0.0
    return min(estimate.statistical_error / estimate.standard_error, 1.0) if known else 1.0
