"""Bounds of what arrives at the controller: what cannot be meant is dropped, what is too large is clipped, and counted.

The measurements' limits are those of ``flight.checks``, beyond which no fixed-wing aircraft moves.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid_node.control.types import ErrorCorrelation, IdentifiedDerivative, Measurements
from sysid_node.flight.checks import (
    AIRSPEED_HIGH,
    AIRSPEED_LOW,
    ANGLE_LIMIT,
    DENSITY_HIGH,
    DENSITY_LOW,
    RATE_LIMIT,
)

Array = NDArray[np.float64]

#: Largest derivative, per rad, that is taken for an estimate: far beyond that of any fixed-wing aircraft.
LARGEST_DERIVATIVE = 1.0e3

#: Least eigenvalue of a correlation matrix: that of a true one is zero but for rounding.
LEAST_EIGENVALUE = -1.0e-4

_ANGLE, _RATE = (-ANGLE_LIMIT, ANGLE_LIMIT), (-RATE_LIMIT, RATE_LIMIT)
#: Plausible values of what is measured, SI.
_PLAUSIBLE: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(("p", "q", "r"), _RATE),
    "phi": (-math.pi, math.pi),
    **dict.fromkeys(("theta", "alpha", "beta"), _ANGLE),
    "airspeed": (AIRSPEED_LOW, AIRSPEED_HIGH),
    "density": (DENSITY_LOW, DENSITY_HIGH),
}


@dataclass
class InputChecks:
    """The checks of one controller. ``counts``: how often each input was dropped or clipped, in words."""

    largest_excitation: Array  # (3,) rad, of elevator, aileron and rudder
    counts: Counter[str] = field(default_factory=Counter)

    def measurements(self, measured: Measurements) -> Measurements:
        """The measurements, NaN (not measured) where a value is implausible."""
        wrong = [
            name
            for name, (lower, upper) in _PLAUSIBLE.items()
            if not lower <= (value := getattr(measured, name)) <= upper and not math.isnan(value)
        ]
        self.counts.update(f"{name} implausible, dropped" for name in wrong)
        return measured._replace(**dict.fromkeys(wrong, math.nan)) if wrong else measured

    def excitation(self, requested: Sequence[float]) -> Array:
        """(3,) rad: the excitation, within its limits; none where a value is not finite."""
        if not all(map(math.isfinite, requested)):
            self.counts["excitation not finite, dropped"] += 1
            return np.zeros(len(self.largest_excitation))
        within: Array = np.clip(np.asarray(requested, dtype=float), -self.largest_excitation, self.largest_excitation)
        if (within != requested).any():
            self.counts["excitation clipped"] += 1
        return within

    def estimates(self, estimates: Mapping[str, IdentifiedDerivative]) -> dict[str, IdentifiedDerivative]:
        """The estimates without those that are called valid but have no usable value and interval."""
        usable = {}
        for name, estimate in estimates.items():
            if estimate.valid and not _in_order(estimate):
                self.counts["estimates implausible, dropped"] += 1
            else:
                usable[name] = estimate
        return usable

    def correlation(self, correlation: ErrorCorrelation) -> ErrorCorrelation | None:
        """The correlation of the estimates' errors; None where it is no correlation matrix of as many names."""
        names, matrix = correlation
        if len(set(names)) == len(names) and matrix.shape == (len(names),) * 2 and _is_correlation(matrix):
            return correlation
        self.counts["correlation implausible, dropped"] += 1
        return None


def _in_order(estimate: IdentifiedDerivative) -> bool:
    """Whether value and interval are finite, plausible, and in order."""
    return -LARGEST_DERIVATIVE <= estimate.lower <= estimate.value <= estimate.upper <= LARGEST_DERIVATIVE


def _is_correlation(matrix: Array) -> bool:
    """Whether a square matrix is symmetric with ones on its diagonal, and has no negative eigenvalue."""
    if not (np.abs(matrix) <= 1.0 + 1e-6).all():  # NaN is not
        return False
    alike = np.allclose(matrix, matrix.T, atol=1e-6) and np.allclose(matrix.diagonal(), 1.0, atol=1e-6)
    return alike and bool((np.linalg.eigvalsh(matrix) >= LEAST_EIGENVALUE).all())
