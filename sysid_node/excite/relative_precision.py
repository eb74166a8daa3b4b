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
    """Half of each 95 % interval over the derivative's size; infinite where the estimate is not valid."""
    found = {}
    for d in derivatives:
        size = max(abs(d.value), LEAST_SIZE * abs(aircraft.derivatives[d.name].value))
        found[d.name] = 0.5 * (d.upper - d.lower) / size if d.valid and size > 0.0 else math.inf
    return found
