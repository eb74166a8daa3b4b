"""The unscented Kalman filter against the published run, maximum likelihood, and the moments it must keep."""

import jax.numpy as jnp
import numpy as np
from kalman_cases import assert_near_maximum_likelihood, published_case
from reference_flights import HFB_EKF, HFB_UKF

from sysid_node.batch.methods.unscented_kalman_filter import sigma_points, unscented_kalman_filter, weighted_moments


def test_it_gives_the_published_figures(flights):
    case, noise = published_case(flights)
    final = unscented_kalman_filter(case.model, [case.manoeuvre], noise).final
    for name, value in HFB_UKF.items():
        assert abs(final[name].value - value) < 0.1 * HFB_EKF[name][1], name


def test_it_ends_near_maximum_likelihood():
    assert_near_maximum_likelihood(unscented_kalman_filter)


def test_sigma_points_have_the_moments_that_they_stand_for():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(4, 4))
    mean, covariance = jnp.array(rng.normal(size=4)), jnp.array(root @ root.T)
    points, weights = sigma_points((mean, covariance))
    found, scatter = weighted_moments(points, weights)
    np.testing.assert_allclose(found, mean, atol=1e-10)
    np.testing.assert_allclose(scatter, covariance, atol=1e-10)
