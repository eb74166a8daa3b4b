"""Extended Kalman filter for state and parameters together: the model is linearised about each estimate.

Jategaonkar, "Flight Vehicle System Identification", 2nd ed. (2015), sec. 7.3. One pass along the flight.
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


def extended_kalman_filter(
    model: StateSpaceModel, manoeuvres: Sequence[ManoeuvreData], noise: FilterNoise
) -> ParameterTrack:
    """The free parameters of ``model`` after each sample. Raises InputError as ``filter_along`` does."""
    return filter_along(model, manoeuvres, noise, EXTENDED)


def correct_linearised(observe: VectorFunction, moments: Moments, y: jax.Array, r: jax.Array) -> Moments:
    """The moments after the measurement ``y``, with ``observe`` linearised about the predicted mean."""
    mean, covariance = moments
    gain, observation = linearised_gain(observe, mean, covariance, r)
    return mean + gain @ (y - observe(mean)), joseph_covariance(gain, observation, covariance, r)


EXTENDED = FilterSteps(predict_linearised, correct_linearised)
