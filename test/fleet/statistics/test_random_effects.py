"""The three-level model: statsmodels where the two coincide, the analysis of variance, and coverage."""

import numpy as np
import pytest

from sysid_node.fleet.statistics.random_effects import fit_random_effects, scatter_of_others

J, N = 8, 6
TAIL = np.repeat(np.arange(J), N)


def balanced(seed=7):
    """Rounded to 0.001, so that another program can be given the same numbers."""
    generator = np.random.default_rng(seed)
    tails, flights = np.repeat(generator.normal(0, 0.8, J), N), generator.normal(0, 0.5, J * N)
    return np.round(3.0 + tails + flights + 0.4 * generator.normal(size=J * N), 3)


def test_is_statsmodels_mixed_model_where_all_known_errors_are_equal():
    """MixedLM of statsmodels 0.15.0, REML: mean, standard errors of the scatters, and predicted effects of tails.

    Its residual variance is the known 0.16 and the scatter of flights together.
    """
    fit = fit_random_effects(balanced(), np.full(J * N, 0.4), np.zeros(J * N), TAIL)
    assert fit.mean == pytest.approx(2.7552708, abs=1e-6)
    assert fit.mean_error == pytest.approx(0.228926, rel=2e-3)
    assert fit.tails.value == pytest.approx(0.606564, rel=3e-3)
    assert fit.flights.value == pytest.approx(0.384736, rel=5e-3)
    assert fit.by_tail.level[:3] - fit.mean == pytest.approx([0.2002831, 0.1202795, -0.4401840], abs=2e-3)


def test_is_the_analysis_of_variance():
    """In a balanced design the restricted maximum likelihood is that of the mean squares (Searle 1971, ch. 9)."""
    y = balanced(3).reshape(J, N)
    within = ((y - y.mean(axis=1, keepdims=True)) ** 2).sum() / (J * (N - 1))
    between = N * y.mean(axis=1).var(ddof=1)
    fit = fit_random_effects(y.ravel(), np.full(J * N, 0.1), np.zeros(J * N), TAIL)
    assert fit.flights.value**2 + 0.01 == pytest.approx(within, rel=5e-3)
    assert fit.tails.value**2 == pytest.approx((between - within) / N, rel=1e-2)


def test_a_systematic_error_common_to_all_flights_moves_no_scatter_and_widens_the_mean():
    y, s = balanced(), np.full(J * N, 0.4)
    without = fit_random_effects(y, s, np.zeros(J * N), TAIL)
    fit = fit_random_effects(y, s, np.full(J * N, 0.3), TAIL)
    assert fit.tails.value == pytest.approx(without.tails.value, rel=1e-2)
    assert fit.total_error == pytest.approx(np.hypot(without.mean_error, 0.3), rel=1e-2)
    assert fit.tails.lower < without.tails.lower  # it could be each tail's own


def test_intervals_hold_the_truth():
    """Of 200 draws the 95 % intervals hold mean and scatters in 90 to 100 %: more than three binomial sigmas."""
    generator, held = np.random.default_rng(5), []
    s = generator.uniform(0.5, 1.5, J * N)
    for _ in range(200):
        y = (
            np.repeat(generator.normal(size=J), N)
            + 0.7 * generator.normal(size=J * N)
            + s * generator.normal(size=J * N)
        )
        fit = fit_random_effects(y, s, np.zeros(J * N), TAIL)
        held.append(
            [fit.lower <= 0 <= fit.upper, *(e.lower <= t <= e.upper for e, t in ((fit.tails, 1), (fit.flights, 0.7)))]
        )
    assert np.mean(held, axis=0) == pytest.approx(0.95, abs=0.05)


def test_one_tail_has_no_scatter_of_tails_and_one_flight_a_tail_none_of_flights():
    one = fit_random_effects(np.array([1.0, 1.2, 0.9]), np.full(3, 0.1), np.zeros(3), np.zeros(3, dtype=int))
    assert np.isnan(one.tails.value) and np.isfinite(one.flights.value)
    each = fit_random_effects(np.array([1.0, 1.6, 0.7]), np.full(3, 0.1), np.zeros(3), np.arange(3))
    assert np.isnan(each.flights.value) and each.tails.value > 0.3


def test_scatter_of_others_leaves_out_the_tail_that_is_odd():
    y = balanced()
    y[TAIL == 2] += 10.0
    tau = scatter_of_others(y, np.full(J * N, 0.4), np.zeros(J * N), TAIL, 0.38)
    rest = fit_random_effects(
        y[TAIL != 2], np.full(J * N - N, 0.4), np.zeros(J * N - N), np.repeat(np.arange(J - 1), N)
    )
    assert tau[2] == pytest.approx(rest.tails.value, rel=0.05)
    assert tau[0] > 3.0


def test_refuses_an_estimate_without_an_error():
    with pytest.raises(ValueError, match="positive statistical errors"):
        fit_random_effects(np.ones(2), np.array([1.0, 0.0]), np.zeros(2), np.zeros(2, dtype=int))
