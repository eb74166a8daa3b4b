"""A fit's values by name, and its correlations."""

import numpy as np

from sysid_node.batch.results.batch_fit import BatchFit, SearchEnd, correlation_matrix
from sysid_node.batch.results.estimate import ParameterEstimate


def test_values_and_correlations():
    covariance = np.array([[4.0, -3.0], [-3.0, 9.0]])
    estimates = {
        name: ParameterEstimate(name, value, 1.0, 0.0, 0.0, True, "ok", 1.0)
        for name, value in (("Cm_q", -12.0), ("Cm_de", -1.2))
    }
    fit = BatchFit("equation_error", estimates, covariance, {}, 0.0, [], SearchEnd(True, 1, ""))
    assert fit.values == {"Cm_q": -12.0, "Cm_de": -1.2}
    np.testing.assert_allclose(fit.correlation, [[1.0, -0.5], [-0.5, 1.0]])


def test_a_parameter_without_variance_is_correlated_with_nothing():
    np.testing.assert_array_equal(correlation_matrix(np.diag([0.0, 2.0])), np.eye(2))
