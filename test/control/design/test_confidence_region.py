"""The region about the estimates: corners of intervals, or points of the joint 95 % ellipsoid, beside scipy's chi2."""

from itertools import product

import numpy as np
import pytest
from scipy.stats import chi2, norm

from sysid_node.control.design.confidence_region import DIRECTIONS, region_points

VALUES, HALF, SIGNALS = np.array([1.0, -2.0, 0.5]), np.array([0.1, 0.3, 0.2]), np.array([1.0, 0.2, 0.5])


def random_correlation(n: int, seed: int = 0) -> np.ndarray:
    errors = np.random.default_rng(seed).normal(size=(n, 2 * n))
    covariance = errors @ errors.T
    deviation = np.sqrt(covariance.diagonal())
    return np.asarray(covariance / np.outer(deviation, deviation))


def distances(points: np.ndarray, half: np.ndarray, correlation: np.ndarray) -> np.ndarray:
    """Squared Mahalanobis distances from the first point, of intervals that are 1.96 standard errors on each side."""
    errors = half / norm.ppf(0.975)
    off = points - points[0]
    return np.einsum("ni,ij,nj->n", off, np.linalg.inv(correlation * np.outer(errors, errors)), off)


def test_without_correlation_it_is_the_corners_of_the_intervals() -> None:
    points = region_points(VALUES, HALF, SIGNALS, None)
    np.testing.assert_array_equal(points[0], VALUES)
    corners = [VALUES + np.array(signs) * HALF for signs in product((-1.0, 1.0), repeat=3)]
    np.testing.assert_allclose(np.unique(points[1:].round(12), axis=0), np.unique(np.round(corners, 12), axis=0))


@pytest.mark.parametrize("n", [1, 2, 5, 8])
def test_with_correlation_all_points_are_at_the_distance_that_holds_95_percent_of_all_errors(n: int) -> None:
    half, correlation = np.linspace(0.1, 0.3, n), random_correlation(n)
    points = region_points(np.zeros(n), half, np.ones(n), correlation)
    assert len(points) == 1 + 2**n + 2 * n
    np.testing.assert_allclose(distances(points, half, correlation)[1:], chi2.ppf(0.95, n), rtol=1e-6)


def test_one_estimate_alone_has_its_interval() -> None:
    half = np.array([0.0, 0.3, 0.0])
    points = region_points(VALUES, half, SIGNALS, np.eye(3))
    np.testing.assert_allclose(sorted({*points[1:, 1].round(9)}), [-2.3, -1.7])
    assert (points[:, [0, 2]] == VALUES[[0, 2]]).all()


def test_errors_that_go_together_are_not_taken_apart() -> None:
    points = region_points(VALUES, HALF, SIGNALS, np.ones((3, 3)))
    steps = (points[1:] - VALUES) / HALF
    np.testing.assert_allclose(np.abs(steps), 1.0)
    np.testing.assert_allclose(steps, np.repeat(steps[:, :1], 3, axis=1))


def test_where_all_is_exact_there_is_the_one_point() -> None:
    np.testing.assert_array_equal(region_points(VALUES, np.zeros(3), SIGNALS, np.eye(3)), VALUES[None])


@pytest.mark.parametrize("known", [True, False])
def test_of_many_the_directions_with_the_largest_effect_count(known: bool) -> None:
    n = DIRECTIONS + 3
    half = np.linspace(1.0, 0.1, n)
    points = region_points(np.zeros(n), half, np.ones(n), np.eye(n) if known else None)
    assert len(points) == 1 + 2**DIRECTIONS + 2 * DIRECTIONS * known
    assert (points[:, DIRECTIONS:] == 0.0).all()
    assert (np.abs(points[1:, :DIRECTIONS]).max(axis=0) > 0.0).all()
