"""Estimates as those who use them want them."""

from __future__ import annotations

import math
from collections.abc import Iterable

from sysid_node.aircraft.model import Aircraft
from sysid_node.control.types import Belief
from sysid_node.online.types import DerivativeEstimate, Estimates

#: Share of the file's value that a derivative's size is at least taken for: one near zero cannot be known to a percent.
LEAST_SIZE = 0.3


def beliefs_of(estimates: Estimates) -> dict[str, Belief]:
    """For the controller."""
    explained = {name: fit.r_squared for name, fit in estimates.fits.items()}
    return {
        d.name: Belief(d.value, d.lower, d.upper, d.valid, explained.get(d.name.partition("_")[0], 0.0))
        for d in estimates.derivatives.values()
    }


def precision_of(derivatives: Iterable[DerivativeEstimate], aircraft: Aircraft) -> dict[str, float]:
    """For the exciter: half of each interval over the derivative's size, infinite where it is not valid."""
    found = {}
    for d in derivatives:
        size = max(abs(d.value), LEAST_SIZE * abs(aircraft.derivatives[d.name].value))
        found[d.name] = 0.5 * (d.upper - d.lower) / size if d.valid and size > 0.0 else math.inf
    return found
