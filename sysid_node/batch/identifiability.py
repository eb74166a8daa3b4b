"""Which parameters a flight cannot tell apart, and which it says nothing about, in words.

Klein & Morelli (2006), sec. 5.3.4 and 6.1: pairwise correlations above 0.9 call for caution; the singular vectors of
the scaled sensitivities (Belsley, Kuh & Welsch, "Regression Diagnostics", 1980, ch. 3) find combinations of three and
more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.batch.result import correlation
from sysid_node.flight.record import Array

#: Two estimates correlated more than this cannot be told apart.
HIGH_CORRELATION = 0.95
#: Condition number of the scaled sensitivities beyond which a combination is not determined (Belsley: 30 is moderate).
HIGHEST_CONDITION = 1e6


def null_combination(information: Array, names: Sequence[str]) -> tuple[str, ...]:
    """Parameters of the combination that the data do not determine at all; empty where all are determined.

    ``information`` (P, P) is the Fisher information. A parameter without any effect stands alone.
    """
    scale = np.sqrt(np.clip(np.diag(information), 0.0, None))
    without = tuple(name for name, s in zip(names, scale, strict=True) if not s > 0.0)
    if without:
        return without
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    if values[0] * HIGHEST_CONDITION**2 > values[-1]:
        return ()
    weight = np.abs(vectors[:, 0])
    return tuple(name for name, w in zip(names, weight, strict=True) if w > 0.1 * weight.max())


def inseparable_pairs(covariance: Array, names: Sequence[str]) -> list[tuple[str, str, float]]:
    """Pairs of parameters that the flight hardly tells apart, with their correlation, the worst first."""
    table = correlation(covariance)
    pairs = [
        (names[i], names[j], float(table[i, j]))
        for i in range(len(names))
        for j in range(i + 1, len(names))
        if abs(table[i, j]) > HIGH_CORRELATION
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def sentences(pairs: Sequence[tuple[str, str, float]]) -> list[str]:
    """The pairs in words."""
    return [f"{a} and {b} cannot be told apart here (correlation {value:+.3f})" for a, b, value in pairs]
