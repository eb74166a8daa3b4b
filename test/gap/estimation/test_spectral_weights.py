"""Weighted rows of residuals; truth: Parseval, white noise of known power, and the likelihood's own maximum."""

import numpy as np
import pytest

from sysid_node.gap.estimation.spectral_weights import (
    amplitudes,
    real_rows,
    residual_power,
    spectral_deviance,
    weights,
)
from sysid_node.gap.residuals.windowed_spectra import Windows

RATE, SAMPLES = 50.0, 5000


@pytest.fixture(scope="module")
def windows() -> Windows:
    return Windows.over(SAMPLES, RATE)


def test_rows_of_noise_of_the_assumed_power_count_each_independent_sample_once(windows) -> None:
    """Sum of squares of white noise in the band: as many as there are independent samples of it, by its deviation."""
    power, random = np.full((windows.frequencies.size, 12), 4.0), np.random.default_rng(1)
    noise = windows.transform(2.0 * random.standard_normal((SAMPLES, 12)))
    rows = real_rows(noise, weights(power))
    independent = 12 * 2 * windows.frequencies[-1] * SAMPLES / RATE
    assert np.sum(rows**2) == pytest.approx(independent, rel=0.05)


def test_amplitudes_are_the_inverse_of_rows(windows) -> None:
    random = np.random.default_rng(2)
    weight = weights(random.uniform(0.5, 2.0, (windows.frequencies.size, 12)))
    spectra = windows.transform(random.standard_normal((SAMPLES, 12)))
    np.testing.assert_allclose(amplitudes(real_rows(spectra, weight), weight), spectra, atol=1e-12)


def test_slopes_are_weighted_as_residuals_are(windows) -> None:
    random = np.random.default_rng(3)
    weight = weights(random.uniform(0.5, 2.0, (windows.frequencies.size, 12)))
    spectra = windows.transform(random.standard_normal((SAMPLES, 12, 2)))
    both = real_rows(spectra, weight)
    for k in range(2):
        np.testing.assert_array_equal(both[..., k], real_rows(spectra[..., k], weight))


def test_power_is_at_least_the_sensors_noise(plain_model) -> None:
    nothing = np.zeros(plain_model.measured.shape, complex)
    np.testing.assert_array_equal(
        residual_power(plain_model, nothing, plain_model.simulator.neutral()), plain_model.noise
    )


def test_the_deviance_of_more_power_is_more(plain_model) -> None:
    """Of power P above the noise it is, up to a constant, as many logarithms of P as there are data."""
    power = 100.0 * plain_model.noise
    more, less = (spectral_deviance(plain_model, p, plain_model.simulator.neutral()) for p in (np.e * power, power))
    change = more - less
    lines = power.shape[0] - 0.5  # the mean has no imaginary part
    assert change == pytest.approx(plain_model.windows.count * lines * power.shape[1])
