"""Linear least squares between bounds, from normal equations."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import lsq_linear

from sysid_node.flight.record import Array

#: Half the width that is left to an unknown whose bounds coincide, in its own standard deviations. SciPy needs some.
_LEAST_WIDTH = 1e-6

#: Share of an unknown's information that is added where rounding has made the information matrix singular.
_REGULARISATION = 1e-10


def bounded_least_squares(information: Array, right: Array, low: Array, high: Array) -> Array:
    """The step (K,) that minimises the sum of squares with ``information @ step = right``, ``low <= step <= high``.

    ``information`` (K, K) is symmetric and positive definite; zero lies between the bounds (K,).
    """
    spread = np.diag(information) ** -0.5
    factor = upper_factor(information * np.outer(spread, spread))
    target = np.linalg.solve(factor.T, right * spread)
    found = lsq_linear(
        factor, target, (np.minimum(low / spread, -_LEAST_WIDTH), np.maximum(high / spread, _LEAST_WIDTH))
    )
    return np.asarray(found.x * spread)


def upper_factor(information: Array) -> Array:
    """Upper triangular factor R (K, K) of a matrix ``information = R' R`` (K, K) whose diagonal is one.

    Where slopes are so large and so nearly collinear that rounding makes the matrix singular, a small multiple of its
    diagonal is added.
    """
    try:
        return np.asarray(np.linalg.cholesky(information).T)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.cholesky(information + _REGULARISATION * np.eye(len(information))).T)


def solve(information: Array, right: Array) -> Array:
    """``information^-1 right`` (K, ...), of a symmetric positive definite matrix (K, K).

    Raises LinAlgError where one of them is not finite, as where a prediction has diverged.
    """
    if not (np.isfinite(information).all() and np.isfinite(right).all()):
        raise np.linalg.LinAlgError("the information is not finite")
    solved: Array = cho_solve(cho_factor(information), right)
    return solved
