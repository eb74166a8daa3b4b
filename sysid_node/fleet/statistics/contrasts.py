"""Several contrasts of correlated estimates, and the probability that chance makes one as improbable as the least.

A contrast asks whether the estimates follow a course over the flights (a step at a date, a straight line, another
configuration) beside a constant level. The contrast with the smallest weighted p-value is tested, and its p-value
allows for the search over all (Hawkins 1977, J. Am. Stat. Assoc. 72:180; Worsley 1982, Biometrika 69:297; weights:
Genovese, Roeder & Wasserman 2006, Biometrika 93:509). A question that several contrasts ask, as whether there is a step
at some date, weighs as much as one that a single contrast asks, as whether there is a trend.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from sysid_node.flight.record import Array

_DRAWS = 4_000  # which give a p-value to about 2 % of itself
_MATTERS = 0.05


@dataclass(frozen=True)
class ContrastTests:
    """Statistics (K,) of all contrasts, amplitudes and standard errors; the ``best`` one, and its p-value."""

    statistic: Array
    amplitude: Array
    error: Array
    best: int
    p_value: float


def compare_contrasts(
    value: Array, covariance: Array, courses: Array, questions: Sequence[str], freedom: int, seed: int = 0
) -> ContrastTests:
    """Tests of the ``courses`` (K, n) in estimates ``value`` (n,) with ``covariance`` (n, n) beside a free level.

    ``questions`` (K,) say which courses ask the same question. Amplitude and error are those of generalised least
    squares. The variances count as known but for a common factor with so many degrees of ``freedom``, so that each
    statistic has Student's t distribution. The p-value of the best is simulated; where it would not be significant
    alone, it is Bonferroni's bound.
    """
    inverse = np.linalg.inv(covariance)
    level = inverse.sum(axis=0)
    beside = inverse - np.outer(level, level) / level.sum()
    information = np.einsum("kn,nm,km->k", courses, beside, courses)
    error = 1.0 / np.sqrt(information)
    amplitude = (courses @ beside @ value) * error**2
    statistic = amplitude / error
    whitened = error[:, None] * (courses @ beside @ np.linalg.cholesky(covariance))  # (K, n): unit rows
    weight = _weights(whitened, questions)
    alone = 2.0 * stats.t.sf(np.abs(statistic), freedom) / weight
    best = int(np.argmin(alone))
    return ContrastTests(
        statistic, amplitude, error, best, _p_value(float(alone[best]), weight, whitened, freedom, seed)
    )


def _weights(whitened: Array, questions: Sequence[str]) -> Array:
    """Weight (K,) of each contrast: one over how many independent ones its question amounts to.

    That number follows from the eigenvalues of their correlations (Galwey 2009, Genet. Epidemiol. 33:559).
    """
    weight = np.empty(whitened.shape[0])
    for question in set(questions):
        rows = np.array([other == question for other in questions])
        spread = np.linalg.svd(whitened[rows], compute_uv=False)  # roots of the eigenvalues
        weight[rows] = (spread**2).sum() / spread.sum() ** 2
    return weight


def _p_value(level: float, weight: Array, whitened: Array, freedom: int, seed: int) -> float:
    """Probability that the p-value of some contrast, over its weight (K,), is at most ``level``.

    The statistics are |whitened e| / w with w^2 ~ chi2 / freedom. Importance sampling of Naiman & Priebe (2001, J.
    Comput. Graph. Stat. 10:296): one contrast is drawn, in proportion to the probability that it exceeds its limit, and
    the estimates given that it does; the p-value is Bonferroni's bound times the mean of one over the number of
    contrasts that exceed. It is as exact for one in a million as for one in twenty.
    """
    bound = float(level * weight.sum())
    if level * weight.max() > _MATTERS:  # not significant even without the search
        return min(1.0, bound)
    generator = np.random.default_rng(seed)
    limit = stats.t.isf(0.5 * level * weight, freedom)  # (K,)
    drawn = generator.choice(weight.size, size=_DRAWS, p=weight / weight.sum())
    chosen = whitened[drawn].T  # (n, draws)
    t = stats.t.isf(0.5 * level * weight[drawn] * generator.random(_DRAWS), freedom)
    scale = np.sqrt(generator.gamma(0.5 * (freedom + 1), 2.0 / (1.0 + t**2 / freedom)) / freedom)
    normal = generator.standard_normal(chosen.shape)
    normal += (t * scale - (chosen * normal).sum(axis=0)) * chosen
    exceeding = (np.abs(whitened @ normal) > limit[:, None] * scale).sum(axis=0)
    return float(min(1.0, bound * np.mean(1.0 / np.maximum(exceeding, 1))))
