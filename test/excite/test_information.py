"""Fisher information: against least squares on a linear model, and what cannot be seen."""

import numpy as np
import pytest

from sysid_node.excite.information import FisherInformation, eliminate, fisher

RNG = np.random.default_rng(5)


def test_is_the_covariance_of_weighted_least_squares():
    S = RNG.normal(size=(200, 3, 4))
    sigma = np.array([0.1, 1.0, 5.0])
    X = S.reshape(-1, 4)
    W = np.tile(1 / sigma**2, 200)
    information = FisherInformation(tuple("abcd"), np.ones(4), fisher(S, sigma))
    covariance = np.linalg.inv(X.T @ (W[:, None] * X))
    assert np.allclose(information.covariance, covariance, rtol=1e-9)
    assert np.allclose(information.standard_errors, np.sqrt(np.diag(covariance)))
    size = np.sqrt(np.diag(covariance))
    assert np.allclose(information.correlations, covariance / np.outer(size, size))


def test_unknown_nuisances_widen_as_the_full_inverse_says():
    M = fisher(RNG.normal(size=(50, 2, 6)), np.ones(2))
    reduced = eliminate(M, 4)
    assert np.allclose(np.linalg.inv(reduced), np.linalg.inv(M)[:4, :4])
    assert np.all(np.diag(np.linalg.inv(reduced)) >= np.diag(np.linalg.inv(M[:4, :4])))


def test_units_do_not_matter():
    """Parameters of sizes 1e-6 to 1e6 are inverted as well as those of one size."""
    S = RNG.normal(size=(100, 2, 4))
    scale = 10.0 ** np.array([-6.0, -2.0, 2.0, 6.0])
    plain = FisherInformation(tuple("abcd"), np.ones(4), fisher(S, np.ones(2)))
    scaled = FisherInformation(tuple("abcd"), np.ones(4), fisher(S * scale, np.ones(2)))
    assert np.allclose(scaled.standard_errors * scale, plain.standard_errors, rtol=1e-6)


def test_what_is_not_moved_is_not_known_and_the_rest_is():
    S = RNG.normal(size=(100, 2, 4))
    S[:, :, 2] = 0.0
    information = FisherInformation(tuple("abcd"), np.ones(4), fisher(S, np.ones(2)))
    assert np.isinf(information.standard_errors[2])
    others = [0, 1, 3]
    alone = fisher(S[:, :, others], np.ones(2))
    assert np.allclose(information.standard_errors[others], np.sqrt(np.diag(np.linalg.inv(alone))))
    assert np.all(np.isfinite(information.correlations))


def test_what_always_moves_together_is_not_known_and_named():
    S = RNG.normal(size=(100, 2, 3))
    S[:, :, 2] = 2.0 * S[:, :, 0]
    information = FisherInformation(tuple("abc"), np.ones(3), fisher(S, np.ones(2)))
    assert np.isinf(information.standard_errors[[0, 2]]).all()
    assert np.isfinite(information.standard_errors[1])


def test_pairs_are_worst_first():
    S = RNG.normal(size=(400, 1, 3))
    S[:, :, 1] = S[:, :, 0] + 0.05 * S[:, :, 1]
    information = FisherInformation(tuple("abc"), np.ones(3), fisher(S, np.ones(1)))
    ((first, second, correlation),) = information.pairs(0.9)
    assert (first, second) == ("a", "b")
    assert correlation == pytest.approx(-1 / np.sqrt(1 + 0.05**2), abs=1e-3)
