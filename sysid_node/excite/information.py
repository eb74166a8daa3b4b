"""The information of a flight about parameters: Fisher information, Cramer-Rao bounds, correlations.

For outputs with white Gaussian noise of covariance R the information is M = sum over samples of S' R^-1 S, with S the
outputs' sensitivities; no unbiased estimator has a covariance below M^-1 (Cramer & Rao; Maine & Iliff, NASA RP-1168
(1986), sect. 4.3; Klein & Morelli (2006), sect. 9.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A direction in (scaled) parameter space with less than this share of the largest information counts as unobservable.
_UNOBSERVABLE = 1e-12


@dataclass(frozen=True)
class FisherInformation:
    """The information on ``names`` (P,) where the nuisance parameters are estimated as well.

    ``matrix`` (P, P) is the Fisher information, ``values`` (P,) where it holds; SI units of the parameters.
    """

    names: tuple[str, ...]
    values: Array
    matrix: Array

    @property
    def covariance(self) -> Array:
        """The Cramer-Rao bound (P, P); infinite on the diagonal for an unobservable parameter."""
        size = np.sqrt(np.diag(self.matrix))
        excited = size > 0
        covariance = np.zeros_like(self.matrix)
        np.fill_diagonal(covariance, np.inf)
        covariance[np.ix_(excited, excited)] = _inverse(self.matrix[np.ix_(excited, excited)], size[excited])
        return covariance

    @property
    def standard_errors(self) -> Array:
        """Least standard errors (P,), in the parameters' units."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlations(self) -> Array:
        """Correlations (P, P) of the estimates' errors; zero with an unobservable parameter."""
        covariance = self.covariance
        size = np.sqrt(np.diag(covariance))
        with np.errstate(invalid="ignore"):
            correlations = np.where(np.isfinite(covariance), covariance / np.outer(size, size), 0.0)
        np.fill_diagonal(correlations, 1.0)
        return np.asarray(correlations)

    def pairs(self, threshold: float = 0.9) -> list[tuple[str, str, float]]:
        """Pairs whose errors are correlated beyond ``threshold``, worst first; the flight hardly distinguishes them."""
        correlations = np.triu(self.correlations, 1)
        rows, columns = np.nonzero(np.abs(correlations) > threshold)
        found = [(self.names[i], self.names[j], float(correlations[i, j])) for i, j in zip(rows, columns, strict=True)]
        return sorted(found, key=lambda pair: -abs(pair[2]))


def fisher(sensitivities: Array, sigma: Array) -> Array:
    """Information (P, P) in outputs with sensitivities (N, m, P) and white noise of standard deviations (m,)."""
    scaled = (sensitivities / sigma[None, :, None]).reshape(-1, sensitivities.shape[-1])
    return np.asarray(scaled.T @ scaled)


def eliminate(matrix: Array, count: int) -> Array:
    """Information on the first ``count`` parameters when the others are unknown as well: the Schur complement."""
    A, B, C = matrix[:count, :count], matrix[:count, count:], matrix[count:, count:]
    size = np.sqrt(np.diag(C))
    excited = size > 0
    if not excited.any():
        return A
    return np.asarray(A - B[:, excited] @ _inverse(C[np.ix_(excited, excited)], size[excited]) @ B[:, excited].T)


def _inverse(matrix: Array, size: Array) -> Array:
    """Inverse of a positive matrix with diagonal size^2; directions without information get an infinite variance."""
    values, vectors = np.linalg.eigh(matrix / np.outer(size, size))
    poor = values < _UNOBSERVABLE * values[-1]
    inverse = (vectors[:, ~poor] / values[~poor]) @ vectors[:, ~poor].T
    # a parameter with a component in an unobservable direction has an infinite variance
    unknown = (np.abs(vectors[:, poor]) > 1e-6).any(axis=1)
    inverse[unknown, unknown] = np.inf
    return np.asarray(inverse / np.outer(size, size))
