"""Which parameters a flight cannot tell apart, and which it says nothing about, in words.

Klein & Morelli (2006), sec. 5.3.4 and 6.1: pairwise correlations above 0.9 call for caution; the singular vectors of
the scaled sensitivities (Belsley, Kuh & Welsch, "Regression Diagnostics", 1980, ch. 3) find combinations of three and
more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.batch.results.batch_fit import correlation_matrix
from sysid_node.flight.record import Array

#: Two estimates correlated more than this cannot be told apart.
HIGH_CORRELATION = 0.95
#: Condition number of the scaled sensitivities beyond which a combination is not determined (Belsley: 30 is moderate).
HIGHEST_CONDITION = 1e6


#: Groups of parameters that only together have an effect that the data show; one alone has none.
UnidentifiableGroups = tuple[tuple[str, ...], ...]


def unidentifiable_groups(information: Array, names: Sequence[str]) -> UnidentifiableGroups:
    """What the data do not determine at all: parameters without effect alone, those of one effect together.

    ``information`` (P, P) is the Fisher information. Empty where every parameter is determined.
    """
    size = np.sqrt(np.clip(np.diag(information), 0.0, None))
    without = [i for i, s in enumerate(size) if not s > 0.0]
    kept = [i for i in range(len(names)) if i not in without]
    groups = [{i} for i in without]
    if kept:
        values, vectors = np.linalg.eigh(information[np.ix_(kept, kept)] / np.outer(size[kept], size[kept]))
        null = vectors[:, values * HIGHEST_CONDITION**2 <= values[-1]]
        # the projector on the null space, unlike its vectors, does not mix what has nothing to do with one another
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
    """Groups that share a member as one."""
    apart: list[set[int]] = []
    for group in groups:
        touching = [other for other in apart if other & group]
        apart = [other for other in apart if not other & group] + [group.union(*touching)]
    return apart


def inseparable_pairs(covariance: Array, names: Sequence[str]) -> list[tuple[str, str, float]]:
    """Pairs of parameters that the flight hardly tells apart, with their correlation, the worst first."""
    table = correlation_matrix(covariance)
    pairs = [
        (names[i], names[j], float(table[i, j]))
        for i in range(len(names))
        for j in range(i + 1, len(names))
        if abs(table[i, j]) > HIGH_CORRELATION
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def identifiability_remarks(covariance: Array, names: Sequence[str], groups: UnidentifiableGroups) -> list[str]:
    """In words: what was not determined, and which pairs are hardly told apart."""
    lost = {name for group in groups for name in group}
    kept = [i for i, name in enumerate(names) if name not in lost]
    said = [
        f"nothing here determines {', '.join(group)} apart from one another"
        if len(group) > 1
        else f"nothing here shows {group[0]}"
        for group in groups
    ]
    pairs = inseparable_pairs(covariance[np.ix_(kept, kept)], [names[i] for i in kept])
    return said + [f"{a} and {b} cannot be told apart here (correlation {value:+.3f})" for a, b, value in pairs]
