"""Linear least squares between bounds; truth: SciPy on the factor itself, NumPy, and by hand."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from sysid_node.gap.estimation.bounded_least_squares import bounded_least_squares, solve, upper_factor


@pytest.mark.parametrize("limit", [10.0, 0.5])
def test_the_step_between_bounds_is_the_best_there(random: np.random.Generator, limit: float) -> None:
    root = np.eye(6) + 0.2 * random.standard_normal((6, 6))
    target = random.standard_normal(6)
    best = lsq_linear(root, target, (-limit, limit)).x
    ours = bounded_least_squares(root.T @ root, root.T @ target, np.full(6, -limit), np.full(6, limit))
    np.testing.assert_allclose(ours, best, atol=1e-6)


def test_units_of_the_unknowns_do_not_matter(random: np.random.Generator) -> None:
    root, target = np.eye(3) + 0.2 * random.standard_normal((3, 3)), random.standard_normal(3)
    units, bound = np.array([1e-6, 1.0, 1e6]), np.full(3, 0.4)
    plain = bounded_least_squares(root.T @ root, root.T @ target, -bound, bound)
    scaled_root = root / units
    scaled = bounded_least_squares(scaled_root.T @ scaled_root, scaled_root.T @ target, -bound * units, bound * units)
    np.testing.assert_allclose(scaled / units, plain, atol=1e-6)


def test_an_unknown_whose_bounds_coincide_stays() -> None:
    zero, wide = np.array([0.0, -9.0]), np.array([0.0, 9.0])
    step = bounded_least_squares(np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([1.0, 1.0]), zero, wide)
    np.testing.assert_allclose(step, [0.0, 0.5], atol=1e-5)


def test_information_that_rounding_makes_singular_has_a_factor() -> None:
    alike = np.array([[1.0, 1.0], [1.0, 1.0 - 1e-15]])
    factor = upper_factor(alike)
    np.testing.assert_allclose(factor.T @ factor, alike, atol=1e-9)
    clear = np.array([[1.0, 0.5], [0.5, 1.0]])
    np.testing.assert_array_equal(upper_factor(clear), np.linalg.cholesky(clear).T)


def test_what_is_not_finite_is_an_error_of_linear_algebra() -> None:
    for information, right in ((np.full((2, 2), np.nan), np.ones(2)), (np.eye(2), np.array([1.0, np.inf]))):
        with pytest.raises(np.linalg.LinAlgError, match="not finite"):
            solve(information, right)


def test_solve_is_numpys(random: np.random.Generator) -> None:
    root, right = np.eye(4) + 0.3 * random.standard_normal((4, 4)), random.standard_normal((4, 2))
    np.testing.assert_allclose(solve(root.T @ root, right), np.linalg.solve(root.T @ root, right))
