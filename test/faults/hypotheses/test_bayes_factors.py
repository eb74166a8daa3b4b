"""Bayes factors beside the densities that they are ratios of, and beside Markov's inequality."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from sysid_node.faults.hypotheses import bayes_factors
from sysid_node.faults.hypotheses.bayes_factors import Shift, Shifts

RANDOM = np.random.default_rng(5)
D, N = 6, 40
X = RANDOM.standard_normal((N, D))
P = np.diag(RANDOM.uniform(0.01, 0.1, D))
EACH = (
    Shift(np.zeros(D), np.eye(D)[:, :1], np.array([0.5])),
    Shift(0.3 * np.eye(D)[0], np.eye(D)[:, 1:2], np.array([0.4])),
    Shift(np.zeros(D), np.eye(D)[:, 2:5], np.array([0.3, 0.5, 0.2])),
)
SHIFTS = Shifts(EACH)


def summed(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Information and score of residuals (N,) of variance 1."""
    return X.T @ X, X.T @ y


@pytest.mark.parametrize("shift", EACH)
def test_the_factor_is_the_ratio_of_the_data_s_densities(shift: Shift) -> None:
    y = X @ (0.4 * RANDOM.standard_normal(D)) + RANDOM.standard_normal(N)
    none = multivariate_normal(np.zeros(N), np.eye(N) + X @ P @ X.T)
    spread = X @ shift.free @ np.diag(shift.spread**2) @ shift.free.T @ X.T
    fault = multivariate_normal(X @ shift.fixed, np.eye(N) + X @ P @ X.T + spread)
    J, v = bayes_factors.marginal(*summed(y), np.linalg.inv(P))
    expected = fault.logpdf(y) - none.logpdf(y)
    assert bayes_factors.weigh(J, v, shift).factor == pytest.approx(expected, rel=1e-9)
    loose = bayes_factors.weigh_loosely(*summed(y), shift, np.linalg.inv(P), np.zeros(D), 1.0)
    assert loose.factor == pytest.approx(expected, rel=1e-9)
    looseness = np.full(D, 0.2)
    wider = multivariate_normal(X @ shift.fixed, np.eye(N) + X @ (P + np.diag(looseness**2)) @ X.T + spread)
    loose = bayes_factors.weigh_loosely(*summed(y), shift, np.linalg.inv(P), looseness, 1.0)
    assert loose.factor == pytest.approx(wider.logpdf(y) - none.logpdf(y), rel=1e-9)


def test_many_at_once_are_each_by_itself() -> None:
    y = RANDOM.standard_normal(N)
    J, v = bayes_factors.marginal(*summed(y), np.linalg.inv(P))
    excess = np.array([1.0, 2.5, 1.7])
    for one, shift, scale in zip(bayes_factors.weigh_each(J, v, SHIFTS, excess), EACH, excess, strict=True):
        alone = bayes_factors.weigh(J, v, shift, float(scale))
        assert one.factor == pytest.approx(alone.factor, rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(one.size, alone.size, rtol=1e-9)
        np.testing.assert_allclose(one.covariance, alone.covariance, rtol=1e-9)


def test_what_is_not_worth_it_could_not_have_reached_it() -> None:
    """No factor exceeds what is told of it beforehand; what is left out is said to be impossible."""
    for size in (0.1, 1.0, 5.0):
        y = X @ (size * RANDOM.standard_normal(D)) + RANDOM.standard_normal(N)
        J, v = bayes_factors.marginal(*summed(y), np.linalg.inv(P))
        excess = RANDOM.uniform(1.0, 3.0, 3)
        found = bayes_factors.weigh_each(J, v, SHIFTS, excess)
        bound = bayes_factors.most(SHIFTS, bayes_factors.score_squares(J, v, SHIFTS), excess)
        for i in (0, 2):  # those without a fixed part
            assert found[i].factor <= bound[i] * (1.0 + 1e-5) + 1e-9
        some = bayes_factors.weigh_each(J, v, SHIFTS, excess, np.array([False, False, False]))
        assert [one.factor for one in some] == [found[0].factor, found[1].factor, -np.inf]


@pytest.mark.slow
def test_without_a_fault_factors_are_as_rare_as_markov_says() -> None:
    """10,000 stretches: a factor beyond K comes with a chance of at most 1/K; the score's mean square is 1."""
    root = np.linalg.cholesky(P)
    factors, squares = [], []
    for _ in range(10_000):
        y = X @ (root @ RANDOM.standard_normal(D)) + RANDOM.standard_normal(N)
        J, v = bayes_factors.marginal(*summed(y), np.linalg.inv(P))
        factors.append([weighed.factor for weighed in bayes_factors.weigh_each(J, v, SHIFTS, np.ones(3))])
        squares.append(bayes_factors.score_squares(J, v, SHIFTS))
    found = np.array(factors)
    for bound in (3.0, 10.0, 100.0):
        chance = (found > np.log(bound)).mean(axis=0)
        doubt = np.sqrt(chance / len(found)) + 1e-9
        assert (chance <= 1.0 / bound + 3.0 * doubt).all(), (bound, chance)
    np.testing.assert_allclose(np.mean(squares, axis=0), 1.0, atol=0.05)
