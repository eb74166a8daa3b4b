"""Detects a jammed vane by comparison of its reading with the angle that follows from lift (or side force).

While the vane turns, its reading m and the angle f that solves the force equation both follow the true angle t: their
covariance is that of t plus the noise of each. When it is jammed, m has its noise alone. The
logarithm of the Bayes factor is that of the two covariances (normal deviates; Anderson, "An Introduction to
Multivariate Statistical Analysis", 2nd ed. (1984), sec. 10.8), t's variance being f's less its noise.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_MOTION = 4.0  # least variance of the true angle, in noise variances, for a vane to be tested


def stuck_factor(read: Array, implied: Array, filter: Array, read_noise: float, difference: float) -> float:
    """Log Bayes factor of a jammed vane, from consecutive block means (N,) rad.

    ``filter`` (2,) whitens the difference of the two angles, whose variance is then ``difference``; ``read_noise`` is
    the variance of the vane's noise in a block, rad^2.
    """
    m, f = (_whitened(x, filter) for x in (read, implied))
    n = m.size
    if n < 3:
        return 0.0
    vane = max(read_noise * (1.0 + float(filter @ filter)), 1e-4 * difference)
    force = max(difference - vane, 0.1 * difference)
    motion = float(f @ f) / n - force
    if motion < LEAST_MOTION * max(vane, force):
        return 0.0
    turning = np.array([[motion + vane, motion], [motion, motion + force]])
    second = np.array([[m @ m, m @ f], [m @ f, f @ f]])
    free = _deviance(second, n, turning)
    jammed = float(m @ m) / vane + n * math.log(vane) + float(f @ f) / (motion + force) + n * math.log(motion + force)
    return 0.5 * (free - jammed)


def _deviance(second: Array, n: int, covariance: Array) -> float:
    """-2 log likelihood, constants left out."""
    return float(np.trace(np.linalg.solve(covariance, second))) + n * float(np.linalg.slogdet(covariance)[1])


def _whitened(x: Array, filter: Array) -> Array:
    off = x - x.mean()
    return np.asarray(off[2:] - filter[0] * off[1:-1] - filter[1] * off[:-2])
