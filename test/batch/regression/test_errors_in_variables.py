"""What noise on the regressors does: against its variance as made, and Monte Carlo.

The attenuation of a slope by noise on its regressor: Fuller, "Measurement Error Models" (1987), eq. 1.1.7.
"""

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid_node.batch.regression.errors_in_variables import (
    ErrorsInVariables,
    SensorNoise,
    corrected_normal_equations,
    white_noise_variance,
)
from sysid_node.batch.regression.linear_regression import regress

TIME = 0.01 * np.arange(3000)
SIGMA = 0.3


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def slow(rng, samples=3000):
    """Motion: white noise through two lags of half a second, with a standard deviation of one."""
    x = lfilter([1.0], np.convolve([1.0, -0.98], [1.0, -0.98]), rng.normal(size=samples))
    return x / x.std()


@pytest.mark.parametrize("cutoff", [2.0, 3.0])
def test_white_noise_is_found_beside_motion(rng, cutoff):
    """The least of several levels: by a tenth too little, but never too much."""
    found = [white_noise_variance(TIME, slow(rng) + SIGMA * rng.normal(size=TIME.size), cutoff) for _ in range(40)]
    assert 0.8 < np.mean(found) / SIGMA**2 < 1.02


def test_motion_alone_is_hardly_taken_for_noise(rng):
    found = [white_noise_variance(TIME, slow(rng), 3.0) for _ in range(20)]
    assert np.mean(found) < 0.002  # of a variance of one


def test_a_vibration_is_not_noise(rng):
    x = SIGMA * rng.normal(size=TIME.size) + np.sin(2 * np.pi * 9.0 * TIME)
    assert white_noise_variance(TIME, x, 3.0) == pytest.approx(SIGMA**2, rel=0.25)


def test_nothing_is_claimed_of_what_was_not_sampled(rng):
    assert white_noise_variance(0.1 * np.arange(600), rng.normal(size=600), 3.0) == 0.0
    assert white_noise_variance(TIME, rng.normal(size=TIME.size), 0.0) == 0.0


def noisy_line(rng, variance):
    """y = 2 x with noise of variance 0.09 on the reading of x, and what is said of that noise."""
    x = slow(rng)
    reading = x + SIGMA * rng.normal(size=x.size)
    X = reading[:, None]
    return 2.0 * x, X, ErrorsInVariables(X, 1.0, [SensorNoise(variance, np.zeros(x.size), np.ones((x.size, 1)))])


def test_attenuation_is_undone(rng):
    with_, without = [], []
    for _ in range(60):
        y, X, noisy = noisy_line(rng, SIGMA**2)
        with_.append(regress(["a"], [y], [X], sensor_errors=[noisy]).estimates["a"].value)
        without.append(regress(["a"], [y], [X]).estimates["a"].value)
    assert np.mean(without) == pytest.approx(2.0 / (1.0 + SIGMA**2), rel=0.02)
    assert np.mean(with_) == pytest.approx(2.0, rel=0.005)


def test_no_more_is_taken_out_than_leaves_half(rng):
    y, X, noisy = noisy_line(rng, 50.0)
    information, moment = X.T @ X, X.T @ y
    left, _ = corrected_normal_equations(information, moment, [noisy])
    assert left[0, 0] == pytest.approx(0.5 * information[0, 0])


def test_noise_that_multiplies_is_in_the_standard_error(rng):
    """A manoeuvre at the start, nothing after it: residuals are as uneven as the regressor."""
    x = np.where(TIME < 3.0, np.sin(2 * np.pi * TIME), 0.01)
    found = []
    for _ in range(200):
        response = 2.0 * x * (1.0 + 0.05 * rng.normal(size=x.size))
        noisy = ErrorsInVariables(x[:, None], 1.0, [SensorNoise(0.05**2, 2.0 * x, np.zeros((x.size, 1)))])
        with_ = regress(["a"], [response], [x[:, None]], sensor_errors=[noisy]).estimates["a"]
        without = regress(["a"], [response], [x[:, None]]).estimates["a"]
        found.append((with_.value, with_.standard_error, without.standard_error))
    values, errors, shorter = np.array(found).T
    assert errors.mean() == pytest.approx(values.std(), rel=0.15)
    assert shorter.mean() < 0.6 * values.std()
