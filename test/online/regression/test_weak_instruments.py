"""Intervals of instrumental variables: Student's where they must be, and wide enough where instruments are weak."""

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import made_aircraft
from scipy.stats import t as student

from sysid_node.online.frequency.regression_signals import layout
from sysid_node.online.regression import least_squares, normal_equations, weak_instruments
from sysid_node.online.regression.derivative_index import derivative_index
from sysid_node.online.regression.least_squares import Solution, Uncertainty
from sysid_node.online.regression.weak_instruments import AndersonRubinBounds

Array = NDArray[np.float64]
AIRCRAFT = made_aircraft()


def test_least_squares_have_students_interval() -> None:
    """With curve = 1 / (nu se^2), as the sum of squares of least squares has."""
    errors, freedom = np.array([0.1, 2.0]), np.array([4.0, 40.0])
    t = student.ppf(0.975, freedom)
    anderson_rubin = AndersonRubinBounds(np.zeros(2), 1.0 / (freedom * errors**2), freedom / (freedom + t**2))
    below, above = weak_instruments.interval_arms((t * errors) ** 2, anderson_rubin)
    np.testing.assert_allclose(below, t * errors)
    np.testing.assert_allclose(above, t * errors)


def test_ends_are_where_the_density_of_the_tested_value_allows_no_more() -> None:
    rng = np.random.default_rng(0)
    squares = rng.uniform(0.1, 1.0, 50) ** 2
    anderson_rubin = AndersonRubinBounds(rng.normal(size=50), rng.uniform(0.01, 2.0, 50), rng.uniform(0.5, 1.0, 50))
    below, above = weak_instruments.interval_arms(squares, anderson_rubin)
    ended = np.isfinite(below)
    assert ended.sum() > 20
    np.testing.assert_array_equal(~ended, squares * anderson_rubin.counted * anderson_rubin.curve >= 1.0)
    for delta in (-below[ended], above[ended]):
        allowed = (squares * anderson_rubin.counted)[ended] * (
            1.0 + anderson_rubin.slope[ended] * delta + anderson_rubin.curve[ended] * delta**2
        )
        np.testing.assert_allclose(delta**2, allowed)


PLAN = normal_equations.normal_equations({"Cl": ("p",)}, layout(AIRCRAFT, ("p",)))
P, Z, Y = PLAN.columns[0], PLAN.instruments[0], PLAN.outputs[0]


def solved(
    instrument_strength: float, endogeneity: float, rng: np.random.Generator, lines: int = 40
) -> tuple[Array, Array, Array]:
    """Estimate, standard error and reach of the slope 1 of y = x + u; x = hold z + v, where v is correlated with u."""
    z, u, other = rng.normal(size=(3, lines))
    x = instrument_strength * z + endogeneity * u + np.sqrt(1.0 - endogeneity**2) * other
    values = np.zeros((lines, PLAN.width))
    values[:, P], values[:, Z], values[:, Y] = x, z, x + u
    gram = values.T @ values
    solution = least_squares.solve(PLAN, gram)
    covariance = solution.residual[0] / lines * (z @ z) / (z @ x) ** 2 * np.ones((1, 1, 1))
    anderson_rubin = bent(solution, gram, covariance, lines)
    error = np.sqrt(covariance[0, 0])
    t = student.ppf(0.975, lines)
    return (
        solution.theta[0],
        error,
        np.array(
            weak_instruments.interval_arms((t * error) ** 2, AndersonRubinBounds(*(b[:1] for b in anderson_rubin)))
        ),
    )


def bent(solution: Solution, gram: Array, covariance: Array, freedom: float, gusts: float = 0.0) -> AndersonRubinBounds:
    spread = Uncertainty(covariance, np.ones(1), np.ones((1, 1)), np.full(1, freedom))
    return weak_instruments.anderson_rubin_bounds(
        PLAN, TABLE, solution, gram, spread, covariance, np.ones(1), np.full(1, gusts)
    )


TABLE = derivative_index(AIRCRAFT, PLAN.structure, 0.3)


def test_for_the_share_of_gusts_students_quantile_is_not_paid_back() -> None:
    gram = np.eye(PLAN.width) + 0.5
    solution = least_squares.solve(PLAN, gram)
    still, rough = (bent(solution, gram, np.ones((1, 1, 1)), 10.0, share) for share in (0.0, 1.0))
    t = student.ppf(0.975, 10.0)
    np.testing.assert_allclose(still.counted, 10.0 / (10.0 + t * t))
    np.testing.assert_allclose(rough.counted, 1.0)


def test_what_does_not_come_from_the_residual_does_not_bend() -> None:
    rng = np.random.default_rng(5)
    values = rng.normal(size=(60, PLAN.width))
    gram = values.T @ values
    solution, whole = least_squares.solve(PLAN, gram), np.ones((1, 1, 1))
    spread = Uncertainty(whole, np.ones(1), np.ones((1, 1)), np.full(1, 60.0))
    half = weak_instruments.anderson_rubin_bounds(
        PLAN, TABLE, solution, gram, spread, 0.5 * whole, np.ones(1), np.zeros(1)
    )
    full = bent(solution, gram, whole, 60.0)
    np.testing.assert_allclose(half.curve, 0.5 * full.curve)
    np.testing.assert_allclose(half.slope, 0.5 * full.slope)
    np.testing.assert_allclose(1.0 - half.counted, 0.5 * (1.0 - full.counted))


def test_the_residual_bends_as_it_does() -> None:
    """Sum of squares at values beside the estimate, computed from the lines."""
    rng = np.random.default_rng(2)
    values = rng.normal(size=(60, PLAN.width))
    gram = values.T @ values
    solution = least_squares.solve(PLAN, gram)
    anderson_rubin = bent(solution, gram, np.ones((1, 1, 1)), 60.0)
    place = TABLE.names.index("Cl_p")
    for delta in (-0.3, 0.2):
        moved = ((values[:, Y] - values[:, P] * (solution.theta[0, 0] + delta)) ** 2).sum()
        expected = 1.0 + anderson_rubin.slope[place] * delta + anderson_rubin.curve[place] * delta**2
        assert moved / solution.residual[0] == pytest.approx(expected)


def test_weak_instruments_with_endogenous_regressors_are_covered() -> None:
    """2000 draws, mean F of 10, correlation of 0.9: Student's interval falls short, most where it is short."""
    rng = np.random.default_rng(3)
    draws = [solved(0.5, 0.9, rng) for _ in range(2000)]
    values, errors = np.array([d[0][0] for d in draws]), np.array([d[1][0] for d in draws])
    below, above = np.array([d[2][:, 0] for d in draws]).T
    ours = (values - below <= 1.0) & (values + above >= 1.0)
    students = np.abs(values - 1.0) <= student.ppf(0.975, 40) * errors
    small = errors < np.quantile(errors, 0.3)
    # Anderson and Rubin's is exact; here one of two pieces that go to infinity is the whole line
    assert 0.945 < ours.mean() < 0.98
    assert students[small].mean() < 0.85
    assert ours[small].mean() > students[small].mean() + 0.05
