"""Identifiability: which parameters a flight does not distinguish from one another, and which it does not excite.

Klein & Morelli (2006), sec. 5.3.4 and 6.1: pairwise correlations above 0.9 call for caution; the singular vectors of
the scaled sensitivities (Belsley, Kuh & Welsch, "Regression Diagnostics", 1980, ch. 3) find combinations of three and
more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.batch.results.batch_fit import correlation_matrix
from sysid_node.flight.record import Array

#: Correlation of two estimates beyond which they are not distinguished.
HIGH_CORRELATION = 0.95
#: Condition number of the scaled sensitivities beyond which a combination is not determined (Belsley: 30 is moderate).
HIGHEST_CONDITION = 1e6

#: Groups of parameters of which the data determine only a combination; a group of one has no effect at all.
UnidentifiableGroups = tuple[tuple[str, ...], ...]


def unidentifiable_groups(information: Array, names: Sequence[str]) -> UnidentifiableGroups:
    """The groups of parameters that the data do not determine; empty where every parameter is determined.

    ``information`` (P, P) is the Fisher information. A parameter without effect is a group of its own; collinear ones
    form a group.
    """
    size = np.sqrt(np.clip(np.diag(information), 0.0, None))
    without = [i for i, s in enumerate(size) if not s > 0.0]
    kept = [i for i in range(len(names)) if i not in without]
    groups = [{i} for i in without]
    if kept:
        values, vectors = np.linalg.eigh(information[np.ix_(kept, kept)] / np.outer(size[kept], size[kept]))
        null = vectors[:, values * HIGHEST_CONDITION**2 <= values[-1]]
        # the projector on the null space is unique, unlike its vectors, so that it does not link unrelated parameters
        linked = np.abs(null @ null.T) > 1e-3
        groups += [{kept[k] for k in np.flatnonzero(row)} for row in linked if row.any()]
    return tuple(tuple(names[i] for i in sorted(group)) for group in _merged(groups))


def identifiability_status(name: str, groups: UnidentifiableGroups) -> str:
    """ "ok", "not excited" or "collinear with ..."."""
    for group in groups:
        if name in group:
            others = [other for other in group if other != name]
            return f"collinear with {', '.join(others)}" if others else "not excited"
    return "ok"


def _merged(groups: list[set[int]]) -> list[set[int]]:
    """The groups, those that share a member merged into one."""
    disjoint: list[set[int]] = []
    for group in groups:
        overlapping = [other for other in disjoint if other & group]
        disjoint = [other for other in disjoint if not other & group] + [group.union(*overlapping)]
    return disjoint


def inseparable_pairs(covariance: Array, names: Sequence[str]) -> list[tuple[str, str, float]]:
    """Pairs of parameters with a high correlation, and that correlation, the highest first."""
    table = correlation_matrix(covariance)
    pairs = [
        (names[i], names[j], float(table[i, j]))
        for i in range(len(names))
        for j in range(i + 1, len(names))
        if abs(table[i, j]) > HIGH_CORRELATION
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def identifiability_remarks(covariance: Array, names: Sequence[str], groups: UnidentifiableGroups) -> list[str]:
    """Sentences that say which parameters were not determined, and which pairs are highly correlated."""
    undetermined = {name for group in groups for name in group}
    kept = [i for i, name in enumerate(names) if name not in undetermined]
    remarks = [
        f"nothing here determines {', '.join(group)} apart from one another"
        if len(group) > 1
        else f"nothing here shows {group[0]}"
        for group in groups
    ]
    pairs = inseparable_pairs(covariance[np.ix_(kept, kept)], [names[i] for i in kept])
    return remarks + [
        f"{a} and {b} are hard to tell apart here (correlation {value:+.3f}); their intervals allow for it"
        for a, b, value in pairs
    ]
