"""The iterated Kalman filter against maximum likelihood, and its correction against the most probable state."""

import jax.numpy as jnp
import pytest
from kalman_cases import assert_near_maximum_likelihood
from scipy.optimize import minimize_scalar

from sysid_node.batch.methods.iterated_kalman_filter import correct_iterated, iterated_kalman_filter


def test_it_ends_near_maximum_likelihood():
    assert_near_maximum_likelihood(iterated_kalman_filter)


def test_the_correction_is_the_most_probable_state():
    """A square is measured: prior and measurement together are least squares, which Gauss-Newton solves."""
    (found,), covariance = correct_iterated(
        lambda x: x**2, (jnp.array([2.5]), jnp.array([[1.0]])), jnp.array([9.0]), jnp.array([0.04])
    )
    best = minimize_scalar(lambda x: (x - 2.5) ** 2 + (9.0 - x**2) ** 2 / 0.04, bounds=(1.0, 5.0), method="bounded")
    assert float(found) == pytest.approx(best.x, abs=1e-4)
    assert float(covariance[0, 0]) == pytest.approx(1.0 / (1.0 + (2.0 * best.x) ** 2 / 0.04), rel=1e-3)
