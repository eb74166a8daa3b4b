"""Unscented Kalman filter for state and parameters together: sigma points pass through the model, without derivatives.

Julier & Uhlmann, "Unscented Filtering and Nonlinear Estimation", Proc. IEEE 92(3), 2004; Jategaonkar (2015), sec. 7.4.
Means and covariances are accurate to second order.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp

from sysid_node.batch.likelihood.joint_kalman_filter import (
    FilterNoise,
    FilterSteps,
    Moments,
    VectorFunction,
    filter_along,
)
from sysid_node.batch.models.manoeuvre import ManoeuvreData
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.batch.results.parameter_track import ParameterTrack

#: alpha and beta of the scaled transformation: how far the points spread, and the distribution's shape (2: Gaussian).
_SPREAD, _SHAPE = 0.5, 2.0

Weights = tuple[jax.Array, jax.Array]  # of the points (2n + 1,), for means and for covariances


def unscented_kalman_filter(
    model: StateSpaceModel, manoeuvres: Sequence[ManoeuvreData], noise: FilterNoise
) -> ParameterTrack:
    """The free parameters of ``model`` after each sample. Raises InputError as ``filter_along`` does."""
    return filter_along(model, manoeuvres, noise, UNSCENTED)


def predict_unscented(move: VectorFunction, moments: Moments, q: jax.Array) -> Moments:
    """The moments of the sigma points after ``move``."""
    points, weights = sigma_points(moments)
    mean, scatter = weighted_moments(jax.vmap(move)(points), weights)
    return mean, scatter + jnp.diag(q)


def correct_unscented(observe: VectorFunction, moments: Moments, y: jax.Array, r: jax.Array) -> Moments:
    """The moments after the measurement ``y``, the outputs' moments being those of the sigma points' outputs."""
    mean, covariance = moments
    points, weights = sigma_points(moments)
    outputs = jax.vmap(observe)(points)
    expected, scatter = weighted_moments(outputs, weights)
    innovation = scatter + jnp.diag(r)
    cross = jnp.einsum("k,ki,kj->ij", weights[1], points - mean, outputs - expected)
    gain = jnp.linalg.solve(innovation, cross.T).T
    after = covariance - gain @ innovation @ gain.T
    return mean + gain @ (y - expected), 0.5 * (after + after.T)


def sigma_points(moments: Moments) -> tuple[jax.Array, Weights]:
    """Points (2n + 1, n) with these moments, and their weights; kappa = 3 - n."""
    mean, covariance = moments
    n = mean.size
    scale = _SPREAD**2 * 3.0  # n + lambda
    root = jnp.linalg.cholesky(scale * covariance)
    points = jnp.concatenate([mean[None], mean + root.T, mean - root.T])
    rest = jnp.full(2 * n, 0.5 / scale)
    centre = 1.0 - n / scale
    for_covariance = centre + 1.0 - _SPREAD**2 + _SHAPE
    return points, (jnp.r_[centre, rest], jnp.r_[for_covariance, rest])


def weighted_moments(points: jax.Array, weights: Weights) -> Moments:
    """Mean (m,) and covariance (m, m) of weighted points (2n + 1, m)."""
    mean = weights[0] @ points
    return mean, jnp.einsum("k,ki,kj->ij", weights[1], points - mean, points - mean)


UNSCENTED = FilterSteps(predict_unscented, correct_unscented)
