"""Regression in one pass along the flights."""

import numpy as np
import pytest

from sysid_node.batch.regression.sequential import recursive_estimate


@pytest.mark.parametrize("forgetting", [1.0, 0.98])
def test_one_pass_is_weighted_least_squares(forgetting):
    rng = np.random.default_rng(1)
    X = rng.normal(size=(300, 4))
    y = X @ [1.0, -2.0, 0.5, 3.0] + 0.1 * rng.normal(size=300)
    root = np.sqrt(forgetting ** np.arange(299, -1, -1.0))
    exact = np.linalg.lstsq(root[:, None] * X, root * y, rcond=None)[0]
    values, covariance = recursive_estimate(y, X, forgetting, lambda error: error)
    np.testing.assert_allclose(values, exact, rtol=1e-6)
    np.testing.assert_allclose(covariance, np.linalg.inv((X * root[:, None] ** 2).T @ X), rtol=1e-5, atol=1e-9)
