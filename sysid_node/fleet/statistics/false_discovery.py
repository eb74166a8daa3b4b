"""Many tests at once: the share of false ones among those that are called significant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array

#: False ones among the drifts, the tails that stand out and the derivatives that differ from the file, at most.
FALSE_RATE = 0.05


def adjusted(p_values: Array) -> Array:
    """P-values (N,) adjusted by Benjamini & Hochberg (1995), J. R. Statist. Soc. B 57:289.

    Calling significant what is at most q keeps the expected share of false ones among them at most q, for independent
    tests and for positively dependent ones (Benjamini & Yekutieli 2001, Ann. Statist. 29:1165).
    """
    if not p_values.size:
        return np.empty(0)
    order = np.argsort(p_values)
    ranked = p_values[order] * p_values.size / np.arange(1, p_values.size + 1)
    result = np.empty(p_values.size)
    result[order] = np.minimum(np.minimum.accumulate(ranked[::-1])[::-1], 1.0)
    return result


def significant(p_values: Array, rate: float) -> NDArray[np.bool_]:
    """Which tests (N,) are significant where at most the share ``rate`` of these is to be false."""
    return np.asarray(adjusted(p_values) <= rate)
