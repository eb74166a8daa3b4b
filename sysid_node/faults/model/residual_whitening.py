"""The colour of the residuals in the flight so far: turbulence's, the sensors', the model's own.

Each coefficient's residual is an autoregression of second order, fitted to its autocovariances (Yule & Walker); what
that leaves is correlated between the coefficients of the longitudinal motion, and of the lateral one. Both are
forgotten exponentially. Whitened residuals and regressors make ordinary least squares of what follows (Aitken;
Cochrane & Orcutt, J. American Statistical Association 44, 1949).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ORDER = 2
_RIDGE = 1e-3
_LEAST = 1e-16  # variance of a coefficient that is taken for none
GROUPS = ((0, 1, 4), (2, 3, 5))  # longitudinal, lateral coefficients


@dataclass
class WhiteningFilter:
    """Sums over the past, faded: of residuals (6,), their products by lag (3, 6), those of the innovations (6, 6)."""

    keep: float  # share of the sums that a block later is left
    weight: float = 0.0
    mean: Array = field(default_factory=lambda: np.zeros(6))
    products: Array = field(default_factory=lambda: np.zeros((ORDER + 1, 6)))
    innovations: Array = field(default_factory=lambda: np.zeros((6, 6)))
    past: deque[Array] = field(default_factory=lambda: deque(maxlen=ORDER))
    filter: Array = field(default_factory=lambda: np.zeros((ORDER, 6)))
    unmix: Array = field(default_factory=lambda: np.eye(6))  # innovations to uncorrelated ones of variance 1


def init(memory: float, period: float) -> WhiteningFilter:
    """Nothing known; ``memory`` and ``period`` of the residuals in s."""
    return WhiteningFilter(math.exp(-period / memory))


def learn(colour: WhiteningFilter, residual: Array, follows: bool) -> None:
    """Take in a residual (6,) of sound flight; ``follows``: nothing is missing since the last."""
    if not follows:
        colour.past.clear()
    colour.weight = colour.keep * colour.weight + 1.0
    colour.mean += (residual - colour.mean) / colour.weight
    off = residual - colour.mean
    if len(colour.past) == ORDER:
        earlier = np.array(colour.past)[::-1]  # newest first
        colour.products = colour.keep * colour.products + np.vstack([off * off, off * earlier])
        innovation = off - (colour.filter * earlier).sum(axis=0)
        colour.innovations = colour.keep * colour.innovations + np.outer(innovation, innovation)
    colour.past.append(off)


def settle(colour: WhiteningFilter) -> None:
    """Make filter and whitening from what has been learned."""
    r0, r1, r2 = colour.products / max(colour.weight, 1.0)
    r0 = r0 * (1.0 + _RIDGE) + _LEAST
    det = r0 * r0 - r1 * r1
    colour.filter = np.array([(r0 * r1 - r1 * r2) / det, (r0 * r2 - r1 * r1) / det])
    covariance = colour.innovations / max(colour.weight, 1.0) + _LEAST * np.eye(6)
    colour.unmix = np.zeros((6, 6))
    for group in GROUPS:
        block = np.ix_(group, group)
        colour.unmix[block] = np.linalg.inv(np.linalg.cholesky(covariance[block]))


def scale(colour: WhiteningFilter) -> Array:
    """(6,) standard deviation of the innovations."""
    return np.asarray(np.sqrt(np.diag(colour.innovations) / max(colour.weight, 1.0)))
