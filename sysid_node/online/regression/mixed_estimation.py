"""Mixed estimation: estimates combined with the prior values of the aircraft file.

Both are taken as normal. With the estimate's covariance P and tolerances D of the believed values, the mean is
(P^-1 + D^-1)^-1 (P^-1 theta + D^-1 believed) (mixed estimation: Klein & Morelli 2006, sec. 5.4).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.regression.normal_equations import ModelStructure

Array = NDArray[np.float64]

FREEDOM = 4.0  # degrees of freedom of Student's distribution of a derivative about the aircraft file's


def believed_derivatives(aircraft: Aircraft, structure: ModelStructure) -> tuple[Array, Array]:
    """(P, C) believed values and their precisions 1 / tolerance^2; precision 0 where the file states no tolerance."""
    values, precisions = np.zeros(structure.belongs.shape), np.zeros(structure.belongs.shape)
    for c, coefficient in enumerate(structure.coefficients):
        for i in structure.unknowns(c).tolist():
            belief = aircraft.derivatives[f"{coefficient}_{structure.regressors[i]}"]
            values[i, c] = belief.value
            if belief.tolerance:
                precisions[i, c] = belief.tolerance**-2
    return values, precisions


def improbability(off: Array, precisions: Array, variance: Array) -> float:
    """-2 log p, but for a constant, of estimates that are ``off`` the aircraft file's values.

    ``variance`` is the estimates'. Where the precision is 0 the file says nothing. Student's distribution with few
    degrees of freedom is believed, for a file is now and then far off.
    """
    told = precisions > 0.0
    tolerated = 1.0 / np.where(told, precisions, 1.0)
    squares = np.where(told, off * off / (tolerated + np.maximum(variance, 0.0)), 0.0)
    return float((FREEDOM + 1.0) * np.log1p(squares / FREEDOM).sum())


def weighed(
    structure: ModelStructure, theta: Array, covariance: Array, values: Array, precisions: Array
) -> tuple[Array, Array]:
    """``theta`` (P, C) and its ``covariance`` (C, P, P) with the aircraft file's values counted in."""
    prior = covariance @ (precisions * values).T[:, :, None]
    # gain form: needs no inverse of a covariance that may be near singular
    gain = structure.unit + covariance * precisions.T[:, None]
    return gained(gain, theta.T[..., None] + prior)[..., 0].T, gained(gain, covariance)


def gained(gain: Array, right: Array) -> Array:
    """``right`` (C, P, K) divided by the gain (C, P, P); by least squares where rounding has made the gain singular."""
    try:
        return np.asarray(np.linalg.solve(gain, right))
    except np.linalg.LinAlgError:  # a covariance 1e16 times the tolerances squared
        return np.asarray(np.linalg.pinv(gain) @ right)
