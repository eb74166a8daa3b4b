"""The search by relaxation on problems whose answer is known."""

import numpy as np
from line_problem import LineProblem

from sysid_node.batch.likelihood.maximum_likelihood import SearchOptions, maximise_likelihood, weighted_least_squares


def stationary(problem, z):
    """The gradient of the criterion with the noise at z, in standard errors."""
    noise = problem.noise(z)
    J = problem.jacobian(z, noise)
    return np.linalg.solve(J.T @ J, J.T @ problem.residuals(z, noise)) * np.sqrt(np.diag(J.T @ J))


def test_a_linear_problem_is_solved():
    problem = LineProblem()
    z, rounds, complaint = maximise_likelihood(problem, SearchOptions())
    assert not complaint
    assert rounds < 10
    assert np.abs(stationary(problem, z)).max() < 1e-2


def test_one_round_at_most_is_lost_to_few_evaluations():
    """With one evaluation no round finds a step; else every second round of a slow search would be in vain."""
    _, whole, _ = maximise_likelihood(LineProblem(), SearchOptions())
    _, rounds, complaint = maximise_likelihood(LineProblem(), SearchOptions(early=1))
    assert not complaint
    assert rounds == whole + 1 > 3


def test_a_search_cut_short_says_so():
    _, rounds, complaint = maximise_likelihood(LineProblem(), SearchOptions(rounds=1))
    assert rounds == 1
    assert complaint.startswith("not converged after 1 rounds of noise relaxation")


def test_only_the_chosen_unknowns_are_moved():
    problem = LineProblem()
    start = problem.start()
    moved = weighted_least_squares(problem, start, np.array([1, 3]), np.eye(3), 50)
    assert (moved[[0, 2, 4]] == start[[0, 2, 4]]).all()
    J = problem.jacobian(moved, np.eye(3))[:, [1, 3]]
    assert np.abs(J.T @ problem.residuals(moved, np.eye(3))).max() < 1e-6
