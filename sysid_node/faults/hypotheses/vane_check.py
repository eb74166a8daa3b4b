"""Has a vane jammed? What it reads, beside the angle that lift (side force) speaks of.

The angle m that the vane reads and the angle f that the force's equation asks for both follow the true angle t while
the vane turns: their covariance is that of t plus each one's noise. When it is stuck, m holds its noise alone. The
logarithm of the Bayes factor is that of the two covariances (normal deviates; Anderson, "An Introduction to
Multivariate Statistical Analysis", 2nd ed. (1984), sec. 10.8), t's variance being f's less its noise.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_MOTION = 4.0  # times the noise's variance that the true angle's must be, for a vane to be judged


def stuck_factor(read: Array, asked: Array, filter: Array, read_noise: float, difference: float) -> float:
    """Logarithm of the Bayes factor of a vane that is stuck, from block means (N,) rad in a row.

    ``filter`` (2,) whitens the difference of the two angles, whose variance is then ``difference``; ``read_noise`` is
    the variance of the vane's noise in a block, rad^2.
    """
    m, f = (_whitened(x, filter) for x in (read, asked))
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
