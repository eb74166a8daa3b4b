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
