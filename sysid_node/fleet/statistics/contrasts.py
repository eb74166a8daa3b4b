"""The largest of several contrasts of correlated estimates, and the probability of one as large by chance.

A contrast asks whether the estimates follow a course over the flights (a step at a date, a straight line, another
configuration) beside a constant level. The largest statistic of all contrasts is tested, so that the p-value allows
for the search over dates (Hawkins 1977, J. Am. Stat. Assoc. 72:180; Worsley 1982, Biometrika 69:297).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from sysid_node.flight.record import Array

_DRAWS = (2_000, 100_000)  # the second where the first says that it matters
_MATTERS = 0.05
_ENOUGH = 30  # exceedances for which the simulated p-value is within about 20 %
_BLOCK = 20_000


@dataclass(frozen=True)
class ContrastTests:
    """Statistics (K,) of all contrasts, their amplitudes and standard errors, and the p-value of the largest."""

    statistic: Array
    amplitude: Array
    error: Array
    p_value: float


def compare_contrasts(value: Array, covariance: Array, courses: Array, freedom: int, seed: int = 0) -> ContrastTests:
    """Tests of the ``courses`` (K, n) in estimates ``value`` (n,) with ``covariance`` (n, n) beside a free level.

    Amplitude and error are those of generalised least squares. The variances count as known but for a common factor
    with so many degrees of ``freedom``, so that each statistic has Student's t distribution. The p-value of the
    largest is simulated; it is Bonferroni's bound where fewer than 30 draws exceed it (it is close there) and
    where the largest would not be significant alone.
    """
    inverse = np.linalg.inv(covariance)
    level = inverse.sum(axis=0)
    beside = inverse - np.outer(level, level) / level.sum()
    information = np.einsum("kn,nm,km->k", courses, beside, courses)
    error = 1.0 / np.sqrt(information)
    amplitude = (courses @ beside @ value) * error**2
    statistic = amplitude / error
    whitened = error[:, None] * (courses @ beside @ np.linalg.cholesky(covariance))  # (K, n): unit rows
    largest = float(np.abs(statistic).max())
    return ContrastTests(statistic, amplitude, error, _p_value(largest, whitened, freedom, seed))


def _p_value(largest: float, whitened: Array, freedom: int, seed: int) -> float:
    """Probability that the largest of |whitened e| / sqrt(chi2 / freedom) exceeds ``largest``."""
    alone = float(2.0 * stats.t.sf(largest, freedom))
    bound = float(min(1.0, whitened.shape[0] * alone))
    if alone > _MATTERS:  # not significant even without the search
        return bound
    generator = np.random.default_rng(seed)
    for draws in _DRAWS:
        exceeding = _exceedances(generator, draws, largest, whitened, freedom)
        simulated = (exceeding + 1.0) / (draws + 1.0)
        if simulated > _MATTERS:
            break
    return simulated if exceeding >= _ENOUGH else bound


def _exceedances(generator: np.random.Generator, draws: int, largest: float, whitened: Array, freedom: int) -> int:
    found = 0
    for start in range(0, draws, _BLOCK):
        count = min(_BLOCK, draws - start)
        normal = generator.standard_normal((whitened.shape[1], count))
        scale = np.sqrt(generator.chisquare(freedom, count) / freedom)
        found += int((np.abs(whitened @ normal).max(axis=0) > largest * scale).sum())
    return found
