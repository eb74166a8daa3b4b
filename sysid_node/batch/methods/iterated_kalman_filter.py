"""Iterated extended Kalman filter: each measurement is linearised again about the state that it leads to.

Bell & Cathey, "The Iterated Kalman Filter Update as a Gauss-Newton Method", IEEE Trans. Automatic Control 38(2), 1993:
the correction is Gauss-Newton on the sum of squares of prior and measurement. The prediction is the extended filter's.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax

from sysid_node.batch.likelihood.joint_kalman_filter import (
    FilterNoise,
    FilterSteps,
    Moments,
    VectorFunction,
    filter_along,
    joseph_covariance,
    linearised_gain,
    predict_linearised,
)
from sysid_node.batch.models.manoeuvre import ManoeuvreData
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.batch.results.parameter_track import ParameterTrack

#: Gauss-Newton steps of each correction.
_ITERATIONS = 4


def iterated_kalman_filter(
    model: StateSpaceModel, manoeuvres: Sequence[ManoeuvreData], noise: FilterNoise
) -> ParameterTrack:
    """The free parameters of ``model`` after each sample. Raises InputError as ``filter_along`` does."""
    return filter_along(model, manoeuvres, noise, ITERATED)


def correct_iterated(observe: VectorFunction, moments: Moments, y: jax.Array, r: jax.Array) -> Moments:
    """The moments after the measurement ``y``, with ``observe`` linearised about the corrected mean."""
    mean, covariance = moments

    def relinearised(_: int, x: jax.Array) -> jax.Array:
        gain, observation = linearised_gain(observe, x, covariance, r)
        # x = mean + K (y - h(x) - H (mean - x))
        return mean + gain @ (y - observe(x) - observation @ (mean - x))

    x = jax.lax.fori_loop(0, _ITERATIONS, relinearised, mean)
    gain, observation = linearised_gain(observe, x, covariance, r)
    return x, joseph_covariance(gain, observation, covariance, r)


ITERATED = FilterSteps(predict_linearised, correct_iterated)
