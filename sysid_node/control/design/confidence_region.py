"""Points of the region in which the derivatives are, at which gains must keep their margins.

Where the correlation of the errors is known the region is the ellipsoid that holds all derivatives together with 95 %
(Bombois, Gevers, Scorletti & Anderson, "Robustness analysis tools for an uncertainty set obtained by prediction error
identification", Automatica 37 (2001)). The corners of separate intervals lie far outside it: of five intervals, 4.4
standard errors from the centre, where it reaches to 3.3, and as far in the directions in which errors cannot go
together. Where the correlation is not known, the region is the box of the intervals.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

Array = NDArray[np.float64]

#: The number of directions that are looked at: those with the largest effect.
DIRECTIONS = 8

PROBABILITY = 0.95  # of each interval, and of the ellipsoid
NORMAL_95 = 1.959963984540054  # standard errors in half of an interval
_FLAT = 1e-6  # a direction's least variance, of that of the one with the largest effect


def region_points(values: Array, half: Array, signals: Array, correlation: Array | None) -> Array:
    """(N, D) points of the region about ``values`` (D,), these first.

    ``half`` (D,) of each interval, zero where a derivative counts as exact; ``signals`` (D,): the size of its
    regressor, by which effects are compared; ``correlation`` (D, D) of the errors, None where it is not known.
    """
    effects = half * signals
    uncertain = np.flatnonzero(effects > 0.0)
    if not uncertain.size:
        return values[None]
    known = np.eye(uncertain.size) if correlation is None else correlation[np.ix_(uncertain, uncertain)]
    variances, axes = np.linalg.eigh(effects[uncertain, None] * known * effects[uncertain])
    chosen = np.argsort(-variances, kind="stable")[:DIRECTIONS]
    chosen = chosen[variances[chosen] > _FLAT * variances[chosen[0]]]
    steps = _corners(chosen.size) if correlation is None else _on_ellipsoid(chosen.size)
    points = np.tile(values, (len(steps) + 1, 1))
    points[1:, uncertain] += (steps * np.sqrt(variances[chosen])) @ axes[:, chosen].T / signals[uncertain]
    return points


def _corners(n: int) -> Array:
    """(2^n, n) corners of the unit box."""
    return np.array(list(product((-1.0, 1.0), repeat=n)))


def _on_ellipsoid(n: int) -> Array:
    """(2^n + 2n, n) corners of a box within the ellipsoid and the ends of its axes, in halves of intervals.

    These are the points of a central composite design (Box & Wilson, J. Royal Statistical Society B 13 (1951)).
    """
    radius = math.sqrt(float(chdtri(n, 1.0 - PROBABILITY))) / NORMAL_95
    ends = radius * np.eye(n)
    return np.vstack([_corners(n) * radius / math.sqrt(n), ends, -ends])
