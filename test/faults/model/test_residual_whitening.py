"""Whitening of the residuals. Truth: the covariance of the innovations that come out, from their own definition."""

import numpy as np

from sysid_node.faults.model import residual_whitening
from sysid_node.faults.model.residual_whitening import WhiteningFilter


def learnt() -> WhiteningFilter:
    """A filter that has seen 400 white residuals, correlated with each other."""
    rng = np.random.default_rng(3)
    mixed = rng.standard_normal((400, 6)) @ (np.eye(6) + 0.3)
    whitening = WhiteningFilter(keep=1.0)
    for residual in mixed:
        residual_whitening.learn(whitening, residual, follows=True)
    residual_whitening.settle(whitening)
    return whitening


def test_innovations_become_uncorrelated_and_of_unit_variance():
    whitening = learnt()
    covariance = whitening.innovations / whitening.weight
    for group in residual_whitening.GROUPS:
        block = np.ix_(group, group)
        whitened = whitening.unmix[block] @ covariance[block] @ whitening.unmix[block].T
        assert np.allclose(whitened, np.eye(3), atol=1e-9)


def test_where_rounding_leaves_no_positive_definite_matrix_the_variances_remain():
    whitening = WhiteningFilter(keep=1.0, weight=1.0)
    whitening.innovations = 1e36 * np.ones((6, 6))  # three residuals that are one
    residual_whitening.settle(whitening)
    assert np.isfinite(whitening.unmix).all()
    assert np.allclose(np.diag(whitening.unmix), 1e-18)


def test_residuals_count_with_no_less_than_the_least_noise() -> None:
    """Truth: white noise of that variance beside residuals that are nearly none."""
    whitening = WhiteningFilter(keep=1.0, least=np.full(6, 0.25))
    for k in range(400):
        residual_whitening.learn(whitening, 1e-6 * np.sin(0.1 * k) * np.ones(6), follows=True)
    residual_whitening.settle(whitening)
    assert np.allclose(np.diag(whitening.unmix), 2.0, rtol=1e-6)  # innovations of 0.5 become 1
    assert np.abs(whitening.filter).max() < 1e-6  # what is white needs no filter
    assert np.allclose(residual_whitening.counted_variances(whitening), 0.25)
    assert (residual_whitening.variances(whitening) < 1e-9).all()


def test_residuals_beyond_the_least_noise_are_whitened_as_without_it() -> None:
    plain, other = learnt(), learnt()
    other.least = np.full(6, 0.5)
    residual_whitening.settle(other)
    assert np.allclose(other.unmix, plain.unmix) and np.allclose(other.filter, plain.filter)
