"""Test of over-identifying restrictions: whether all bands of lines tell the same derivatives.

An instrument serves in each of the B bands by itself, so that there are B times as many moment conditions Z_b'r = 0 as
unknowns. If the model is right and gusts do not move the surfaces, the estimates by all of them leave

    J = min over theta of  sum_b (Z_b'(y - X theta))' [S_b Z_b'K Z_b]^-1 (Z_b'(y - X theta))

where S_b is the residual's density in a band and K the correlation of its lines. It has the chi-squared distribution
with (B - 1) p degrees of freedom, p unknowns (Sargan, Econometrica 26, 1958;
Hansen, Econometrica 50, 1982; by bands of frequencies: Engle, International Economic Review 15, 1974). Gusts are
strongest at low frequencies. If an autopilot answers them, low bands tell smaller derivatives than high ones do. A
derivative that the model lacks, or a time that is wrong, also acts differently in each band. J is then many times its
degrees of freedom. The estimates of the bands scatter by as much more than their standard errors, so that the
covariance is multiplied by J over its degrees of freedom (Birge, Phys. Rev. 40, 1932), as far as this is beyond chance.
Few bands tell how large the scatter is, so that it counts by Student's factor for these degrees of freedom.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.regression.information import Information
from sysid_node.online.regression.least_squares import (
    TINY,
    Solution,
    Uncertainty,
    residual_combinations,
    student_95,
)
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]

#: Standard deviations by which J must be larger than by chance to count (positive-part shrinkage).
UNLIKELY = 2.0
#: Share of its energy by which an unknown is set apart from others.
RIDGE = 1e-6
#: Least variance of a combination of moment conditions, of unit variance each: below it they are taken as one.
LEAST = 1e-3


def overidentification(equations: NormalEquations, solution: Solution, info: Information, spread: Uncertainty) -> Array:
    """(C,) J over its degrees of freedom, by the residuals' densities in each band as in ``spread``."""
    structure = equations.structure
    C, P = len(structure.coefficients), equations.columns.size
    v = residual_combinations(equations, solution.theta)
    Z = info.grams[:, equations.instruments]  # (B, P, W)
    white = _whitening(info.scores[:, equations.instruments[:, None], equations.instruments] * structure.same_block)
    per_density = 1.0 / np.sqrt(np.maximum(spread.bands, TINY**2))  # (C, B)
    moments = (white @ ((Z @ v) * structure.belongs)).transpose(2, 0, 1) * per_density[:, :, None]
    slopes = white @ (Z[:, :, equations.columns] * structure.same_block) * per_density[:, :, None, None]
    slopes *= structure.belongs.T[:, None, None]
    e, G = moments.reshape(C, -1), slopes.reshape(C, -1, P)
    across = G.swapaxes(1, 2)
    normal = across @ G
    energy = normal.diagonal(axis1=1, axis2=2)
    normal += structure.unit * (RIDGE * energy + (energy <= TINY))[:, None]
    left = e - (G @ np.linalg.solve(normal, across @ e[..., None]))[..., 0]
    return np.asarray((left * left).sum(axis=1) / _freedom(equations, len(info.grams)))


def _whitening(noise: Array) -> Array:
    """(B, P, P) what makes the moment conditions' covariances ``noise`` (B, P, P) the unit matrix; zero where none."""
    variance = noise.diagonal(axis1=1, axis2=2)
    weight = np.where(variance > TINY**2, 1.0 / np.sqrt(np.maximum(variance, TINY**2)), 0.0)
    values, vectors = np.linalg.eigh(noise * weight[:, :, None] * weight[:, None, :])
    root = vectors / np.sqrt(np.maximum(values, LEAST))[:, None] @ vectors.swapaxes(1, 2)
    return np.asarray(root * weight[:, None])


def _freedom(equations: NormalEquations, bands: int) -> Array:
    """(C,) degrees of freedom of J."""
    return np.asarray((bands - 1) * equations.structure.belongs.sum(axis=0))


def variance_factors(equations: NormalEquations, overidentified: Array, bands: int) -> Array:
    """(C,) factors of the covariance, at least 1, by J over its degrees of freedom of ``overidentified`` (C,)."""
    freedom = _freedom(equations, bands)
    chance = UNLIKELY * np.sqrt(2.0 / freedom)
    excess = np.maximum(overidentified - 1.0, chance)
    few = (student_95(freedom) / student_95(np.full_like(freedom, np.inf))) ** 2
    return np.asarray(1.0 + few * excess * (1.0 - (chance / excess) ** 2))
