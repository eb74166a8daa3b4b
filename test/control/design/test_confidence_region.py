"""The points about the estimates: corners of intervals, or of the joint distribution, beside scipy's distributions."""

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
    return np.asarray(np.einsum("ni,ij,nj->n", off, np.linalg.inv(correlation * np.outer(errors, errors)), off))


def test_without_correlation_margins_are_kept_at_the_corners_of_the_intervals() -> None:
    region = region_points(VALUES, HALF, SIGNALS, None)
    np.testing.assert_array_equal(region.values[0], VALUES)
    corners = [VALUES + np.array(signs) * HALF for signs in product((-1.0, 1.0), repeat=3)]
    np.testing.assert_allclose(np.unique(region.values[1:].round(12), axis=0), np.unique(np.round(corners, 12), axis=0))
    assert region.margins == len(region)


@pytest.mark.parametrize("n", [1, 2, 5, 8])
def test_with_correlation_margins_reach_to_1_96_errors_and_stability_to_the_joint_95_percent(n: int) -> None:
    half, correlation = np.linspace(0.1, 0.3, n), random_correlation(n)
    region = region_points(np.zeros(n), half, np.ones(n), correlation)
    assert region.margins == 1 + 2**n + 2 * n
    assert len(region) == 2 * region.margins - 1
    squares = distances(region.values, half, correlation)
    np.testing.assert_allclose(squares[1 : region.margins], norm.ppf(0.975) ** 2, rtol=1e-6)
    np.testing.assert_allclose(squares[region.margins :], chi2.ppf(0.95, n), rtol=1e-6)


def test_where_margins_are_kept_is_within_every_interval() -> None:
    """The ellipsoid of 1.96 standard errors touches the box of the intervals from within, however errors correlate."""
    for seed in range(5):
        region = region_points(VALUES, HALF, SIGNALS, random_correlation(3, seed))
        assert (np.abs(region.values[: region.margins] - VALUES) <= HALF + 1e-12).all()


def test_one_estimate_alone_has_its_interval() -> None:
    half = np.array([0.0, 0.3, 0.0])
    values = region_points(VALUES, half, SIGNALS, np.eye(3)).values
    np.testing.assert_allclose(sorted({*values[1:, 1].round(9)}), [-2.3, -1.7])
    assert (values[:, [0, 2]] == VALUES[[0, 2]]).all()


def test_errors_that_go_together_are_not_taken_apart() -> None:
    steps = (region_points(VALUES, HALF, SIGNALS, np.ones((3, 3))).values[1:] - VALUES) / HALF
    np.testing.assert_allclose(np.abs(steps), 1.0)
    np.testing.assert_allclose(steps, np.repeat(steps[:, :1], 3, axis=1))


def test_where_all_is_exact_there_is_the_one_point() -> None:
    region = region_points(VALUES, np.zeros(3), SIGNALS, np.eye(3))
    np.testing.assert_array_equal(region.values, VALUES[None])
    assert region.margins == 1


@pytest.mark.parametrize("known", [True, False])
def test_of_many_the_directions_with_the_largest_effect_count(known: bool) -> None:
    n = DIRECTIONS + 3
    half = np.linspace(1.0, 0.1, n)
    region = region_points(np.zeros(n), half, np.ones(n), np.eye(n) if known else None)
    assert region.margins == 1 + 2**DIRECTIONS + 2 * DIRECTIONS * known
    assert (region.values[:, DIRECTIONS:] == 0.0).all()
    assert (np.abs(region.values[1:, :DIRECTIONS]).max(axis=0) > 0.0).all()
