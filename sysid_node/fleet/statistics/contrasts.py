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

_DRAWS = 4_000  # which give a p-value to about 2 % of itself
_MATTERS = 0.05


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
    largest is simulated; where the largest would not be significant alone, it is Bonferroni's bound.
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
    """Probability that the largest of |whitened e| / w, with w^2 ~ chi2 / freedom, exceeds ``largest``.

    Importance sampling of Naiman & Priebe (2001, J. Comput. Graph. Stat. 10:296): one contrast is drawn, and the
    estimates given that it exceeds; the p-value is Bonferroni's bound times the mean of one over the number of
    contrasts that exceed. It is as exact for one in a million as for one in twenty.
    """
    alone = float(2.0 * stats.t.sf(largest, freedom))
    bound = whitened.shape[0] * alone
    if alone > _MATTERS:  # not significant even without the search
        return float(min(1.0, bound))
    generator = np.random.default_rng(seed)
    chosen = whitened[generator.integers(whitened.shape[0], size=_DRAWS)].T  # (n, draws)
    t = stats.t.isf(0.5 * alone * generator.random(_DRAWS), freedom)
    scale = np.sqrt(generator.gamma(0.5 * (freedom + 1), 2.0 / (1.0 + t**2 / freedom)) / freedom)
    normal = generator.standard_normal(chosen.shape)
    normal += (t * scale - (chosen * normal).sum(axis=0)) * chosen
    exceeding = (np.abs(whitened @ normal) > largest * scale).sum(axis=0)
    return float(min(1.0, bound * np.mean(1.0 / np.maximum(exceeding, 1))))
