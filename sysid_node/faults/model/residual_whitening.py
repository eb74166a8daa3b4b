"""Whitens the residuals, whose autocorrelation is due to turbulence, sensors and model errors.

The residual of each coefficient is modelled as an autoregression of second order, fitted to its autocovariances (Yule &
Walker). Its innovations are correlated among the longitudinal coefficients, and among the lateral ones. Both are
estimated with exponential forgetting. With whitened residuals and regressors, ordinary least squares apply (Aitken;
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
_LEAST = 1e-16  # added to the variances, so that none is zero
_LEAST_NOISE = 1e-12  # variance of a coefficient that counts at least; far below any flight's, with digits to spare
GROUPS = ((0, 1, 4), (2, 3, 5))  # longitudinal, lateral coefficients


@dataclass
class WhiteningFilter:
    """Exponentially weighted sums of residuals (6,), their products by lag (3, 6) and innovations' products (6, 6)."""

    keep: float  # factor of the sums at each block
    weight: float = 0.0
    mean: Array = field(default_factory=lambda: np.zeros(6))
    products: Array = field(default_factory=lambda: np.zeros((ORDER + 1, 6)))
    innovations: Array = field(default_factory=lambda: np.zeros((6, 6)))
    past: deque[Array] = field(default_factory=lambda: deque(maxlen=ORDER))
    filter: Array = field(default_factory=lambda: np.zeros((ORDER, 6)))
    unmix: Array = field(default_factory=lambda: np.eye(6))  # makes innovations uncorrelated, with variance 1
    least: Array = field(default_factory=lambda: np.zeros(6))  # variances of the innovations that count at least


def init(memory: float, period: float) -> WhiteningFilter:
    """The state before the first residual; time constant ``memory`` and ``period`` of the residuals in s."""
    return WhiteningFilter(math.exp(-period / memory))


def learn(whitening: WhiteningFilter, residual: Array, follows: bool) -> None:
    """Take a residual (6,) without a fault; ``follows``: none is missing since the last."""
    if not follows:
        whitening.past.clear()
    whitening.weight = whitening.keep * whitening.weight + 1.0
    whitening.mean += (residual - whitening.mean) / whitening.weight
    off = residual - whitening.mean
    if len(whitening.past) == ORDER:
        earlier = np.array(whitening.past)[::-1]  # newest first
        whitening.products = whitening.keep * whitening.products + np.vstack([off * off, off * earlier])
        innovation = off - (whitening.filter * earlier).sum(axis=0)
        whitening.innovations = whitening.keep * whitening.innovations + np.outer(innovation, innovation)
    whitening.past.append(off)


def settle(whitening: WhiteningFilter) -> None:
    """Compute the filter from the sums. What innovations lack of the ``least`` counts as white noise besides."""
    lacking = counted_variances(whitening) - variances(whitening)
    r0, r1, r2 = whitening.products / max(whitening.weight, 1.0)
    r0 = r0 * (1.0 + _RIDGE) + _LEAST + lacking
    det = r0 * r0 - r1 * r1
    whitening.filter = np.array([(r0 * r1 - r1 * r2) / det, (r0 * r2 - r1 * r1) / det])
    covariance = whitening.innovations / max(whitening.weight, 1.0) + _LEAST * np.eye(6)
    covariance += np.diag(lacking)
    whitening.unmix = np.zeros((6, 6))
    for group in GROUPS:
        block = np.ix_(group, group)
        whitening.unmix[block] = np.linalg.inv(_cholesky(covariance[block]))


def _cholesky(covariance: Array) -> Array:
    """The Cholesky factor; of the variances alone where rounding leaves no positive definite matrix."""
    try:
        return np.asarray(np.linalg.cholesky(covariance))
    except np.linalg.LinAlgError:
        return np.diag(np.sqrt(np.diag(covariance)))


def variances(whitening: WhiteningFilter) -> Array:
    """(6,) variances of the innovations, as they were."""
    return np.asarray(np.diag(whitening.innovations) / max(whitening.weight, 1.0))


def counted_variances(whitening: WhiteningFilter) -> Array:
    """(6,) variances with which the innovations count; not zero, not even where no residual has ever changed."""
    return np.maximum(variances(whitening), np.maximum(whitening.least, _LEAST_NOISE))
