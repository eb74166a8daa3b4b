"""Points of the regions in which the derivatives may be, at which gains must keep margins, or stability.

A margin is one number. To keep it with 97.5 %, as far as it goes linearly with the derivatives, it must be kept up to
1.96 standard errors in every direction of their joint distribution: the reliability index of Hasofer & Lind ("Exact and
invariant second-moment code format", ASCE J. Engineering Mechanics 100 (1974)). The loop must be stable in all of the
ellipsoid that holds the derivatives together with 95 % (Bombois, Gevers, Scorletti & Anderson, "Robustness analysis
tools for an uncertainty set obtained by prediction error identification", Automatica 37 (2001)).

Where the correlation of the errors is not known, margins must be kept at the corners of the intervals. Of five
intervals these are 4.4 standard errors away or more, and in directions in which errors may not go together.
"""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

Array = NDArray[np.float64]

#: The number of directions that are looked at: those with the largest effect.
DIRECTIONS = 8

PROBABILITY = 0.95  # of each interval, and of the ellipsoid
NORMAL_95 = 1.959963984540054  # standard errors in half of an interval
_FLAT = 1e-6  # a direction's least variance, of that of the one with the largest effect


class RegionPoints(NamedTuple):
    """Derivatives (N, D) at which margins must be kept, then those at which the loop must be stable."""

    values: Array
    margins: int  # how many come first

    def __len__(self) -> int:
        return len(self.values)


def region_points(values: Array, half: Array, signals: Array, correlation: Array | None) -> RegionPoints:
    """Points about ``values`` (D,), these first.

    ``half`` (D,) of each interval, zero where a derivative counts as exact; ``signals`` (D,): the size of its
    regressor, by which effects are compared; ``correlation`` (D, D) of the errors, None where it is not known.
    """
    effects = half * signals
    uncertain = np.flatnonzero(effects > 0.0)
    if not uncertain.size:
        return RegionPoints(values[None], 1)
    known = np.eye(uncertain.size) if correlation is None else correlation[np.ix_(uncertain, uncertain)]
    variances, axes = np.linalg.eigh(effects[uncertain, None] * known * effects[uncertain])
    chosen = np.argsort(-variances, kind="stable")[:DIRECTIONS]
    chosen = chosen[variances[chosen] > _FLAT * variances[chosen[0]]]
    n = chosen.size
    near = _corners(n) if correlation is None else _on_sphere(n)
    far = np.zeros((0, n)) if correlation is None else joint_radius(n) * _on_sphere(n)
    steps = np.vstack([np.zeros(n), near, far])
    points = np.tile(values, (len(steps), 1))
    points[:, uncertain] += (steps * np.sqrt(variances[chosen])) @ axes[:, chosen].T / signals[uncertain]
    return RegionPoints(points, 1 + len(near))


def joint_radius(n: int) -> float:
    """The radius of the ellipsoid that holds n derivatives together, in halves of intervals."""
    return math.sqrt(float(chdtri(n, 1.0 - PROBABILITY))) / NORMAL_95


def _corners(n: int) -> Array:
    """(2^n, n) corners of the unit box."""
    return np.array(list(product((-1.0, 1.0), repeat=n)))


def _on_sphere(n: int) -> Array:
    """(2^n + 2n, n) points of the unit sphere: the corners of a box within it, and the ends of its axes.

    These are the points of a central composite design (Box & Wilson, J. Royal Statistical Society B 13 (1951)).
    """
    return np.vstack([_corners(n) / math.sqrt(n), np.eye(n), -np.eye(n)])
