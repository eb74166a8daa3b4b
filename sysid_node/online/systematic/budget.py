"""The error budget: what each derivative's uncertainty is made of, largest first (GUM: JCGM 100:2008, sec. 5 and 8).

A source's share is the part of the variance that would vanish if the source were known exactly. This is what a user
decides by, who can weigh, measure or calibrate one thing at a time. Sources that the flight has correlated overlap:
shares need not add up to one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]

STATISTICAL = "statistical"
LEAST = 0.005  # share under which a source is not listed


@dataclass(frozen=True)
class Budget(Mapping[str, Mapping[str, float]]):
    """By derivative the shares of its variance by source, largest first; computed when one is looked at."""

    names: tuple[str, ...]  # (D,)
    sources: tuple[str, ...]  # (K,) keys of tolerances; the same key twice counts as one source
    jacobian: Array  # (K, D)
    covariance: Array  # (K, K) of the sources
    statistical: Array  # (D,) variances

    def with_variances(self, statistical: Array) -> Budget:
        """The budget with other ``statistical`` variances (D,)."""
        return Budget(self.names, self.sources, self.jacobian, self.covariance, statistical)

    def __getitem__(self, name: str) -> Mapping[str, float]:
        d = self.names.index(name)
        gradient, total = self.covariance @ self.jacobian[:, d], float(self.statistical[d])
        total += float(self.jacobian[:, d] @ gradient)
        shares = {STATISTICAL: float(self.statistical[d])}
        for key, places in _groups(self.sources).items():
            within = self.covariance[np.ix_(places, places)]
            shares[key] = float(gradient[places] @ np.linalg.lstsq(within, gradient[places], rcond=1e-12)[0])
        relative = {key: value / total if total > 0.0 else 0.0 for key, value in shares.items()}
        ordered = sorted(relative.items(), key=lambda item: -item[1])
        return {key: share for key, share in ordered if share >= LEAST}

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __reduce__(self) -> tuple[type, tuple[dict[str, dict[str, float]]]]:
        return dict, ({name: dict(shares) for name, shares in self.items()},)


def _groups(keys: Sequence[str]) -> dict[str, list[int]]:
    """Places of each key."""
    found: dict[str, list[int]] = {}
    for i, key in enumerate(keys):
        found.setdefault(key, []).append(i)
    return found
