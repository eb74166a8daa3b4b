"""The fit at the end of a search: intervals, statuses and remarks."""

import numpy as np
from line_problem import LineProblem

from sysid_node.batch.likelihood.covariance import assessed_fit
from sysid_node.batch.likelihood.maximum_likelihood import SearchOptions, maximise_likelihood


def test_standard_errors_are_those_of_the_information_for_white_residuals():
    """The residuals of random responses are white: both standard errors agree."""
    problem = LineProblem()
    z, rounds, complaint = maximise_likelihood(problem, SearchOptions())
    fit = assessed_fit("output_error", problem, z, rounds, complaint, {"sensor_q": 1.0})
    noise = problem.noise(z)
    J = problem.jacobian(z, noise)
    exact = np.sqrt(np.diag(np.linalg.inv(J.T @ J)))
    for estimate, value, error in zip(fit.estimates.values(), z, exact, strict=True):
        assert estimate.value == value
        np.testing.assert_allclose(estimate.white_error, error, rtol=1e-9)
        np.testing.assert_allclose(estimate.standard_error, error, rtol=0.6)
        assert estimate.lower < estimate.value < estimate.upper
        assert estimate.status == "ok"
    assert fit.search.converged
    assert fit.extras == {"sensor_q": 1.0}
    np.testing.assert_allclose(fit.log_det, 2.0 * np.sum(np.log(np.diag(noise))))
    np.testing.assert_allclose(list(fit.noise.values()), np.diag(noise))


def test_a_direction_without_effect_is_named():
    problem = LineProblem()
    problem.directions[:, :, 1] = problem.directions[:, :, 0]
    problem.directions[:, :, 4] = 0.0
    fit = assessed_fit("output_error", problem, problem.start(), 3, "not converged after 3 rounds")
    assert fit.estimates["Za"].status == "collinear with Zd"
    assert fit.estimates["Md"].status == "not excited"
    assert not fit.search.converged
    assert fit.search.message == "not converged after 3 rounds"
    assert "nothing here shows Md" in fit.remarks
