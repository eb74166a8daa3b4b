"""The estimation problem: noise, weighting by it, and the Jacobian against finite differences."""

import numpy as np
import pytest
from line_problem import LineProblem
from made_models import NOISE

from sysid_node.batch.likelihood.problem import in_noise_units, inverted
from sysid_node.errors import InputError


@pytest.fixture(scope="module")
def problem():
    return LineProblem()


def test_the_noise_is_the_residuals_root_mean_square(problem):
    z = problem.start()
    residuals = problem.manoeuvre.outputs - problem.directions @ z
    np.testing.assert_allclose(problem.noise(z), np.diag(np.sqrt(np.mean(residuals**2, axis=0))), rtol=1e-12)


def test_the_jacobian_is_that_of_the_residuals_and_priors(problem):
    z, noise = problem.start(), np.diag(NOISE)
    jacobian = problem.jacobian(z, noise)
    for k in range(5):
        step = np.eye(5)[k] * 1e-4
        slope = (problem.residuals(z + step, noise) - problem.residuals(z - step, noise)) / 2e-4
        np.testing.assert_allclose(jacobian[:, k], slope, rtol=1e-6, atol=1e-6)
    assert jacobian[-1].tolist() == [0.0, 0.0, 0.0, -2.0, 0.0]  # the prior of Mq, 1 sigma 0.5


def test_a_full_noise_covariance_is_whitened():
    rng = np.random.default_rng(3)
    factor = np.array([[1.0, 0.0], [0.7, 0.2]])
    rows = rng.normal(size=(20000, 2)) @ factor.T
    np.testing.assert_allclose(np.cov(in_noise_units(rows, factor).T), np.eye(2), atol=0.03)


def test_what_has_no_information_has_no_variance():
    np.testing.assert_allclose(inverted(np.diag([4.0, 0.0])), np.diag([0.25, 0.0]))


def test_too_few_measurements_are_refused(problem):
    short = LineProblem()
    outputs = np.full_like(short.manoeuvre.outputs, np.nan)
    outputs[:3] = 0.0
    short.manoeuvre.outputs[:] = outputs
    with pytest.raises(InputError, match="9 measured values for 5 unknowns"):
        short.check(short.start())


def test_sensitivities_beyond_all_numbers_are_refused():
    """As of a model that tumbles: its responses stay finite, and their derivatives do not."""
    problem = LineProblem()
    problem.directions[100:] = np.inf
    with pytest.raises(InputError, match="becomes so unstable in the search"):
        problem.jacobian(problem.start(), np.eye(3))
