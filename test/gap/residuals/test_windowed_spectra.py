"""Windows keep power and count every sample once: Parseval, and white noise."""

import numpy as np
import pytest

from sysid_node.gap.residuals.windowed_spectra import INDEPENDENT_SHARE, Windows, power_of


def test_white_noise_keeps_its_variance(random) -> None:
    windows = Windows.over(20000, 50.0)
    power = np.abs(windows.transform(random.standard_normal(20000))) ** 2
    assert power[:, 1:].mean() == pytest.approx(1.0, abs=0.03)


def test_a_sine_lies_on_its_line() -> None:
    windows = Windows.over(2000, 50.0)
    series = np.sin(2 * np.pi * 1.5 * np.arange(2000) / 50.0)
    spectrum = np.abs(windows.transform(series)).mean(axis=0)
    assert windows.frequencies[spectrum.argmax()] == pytest.approx(1.5, abs=0.5 / windows.length)


def test_coefficients_count_each_sample_once() -> None:
    """Twice as many coefficients as samples in the band: each window of T s has one line each 1/T, every T/2."""
    windows = Windows.over(50000, 50.0)
    independent = 2 * windows.frequencies[-1] * 1000.0  # real numbers in 1000 s of this band
    assert INDEPENDENT_SHARE * 2 * windows.count * (windows.frequencies.size - 1) == pytest.approx(
        independent, rel=0.02
    )


def test_windows_fill_the_flight_and_overlap_by_half() -> None:
    windows = Windows.over(2000, 50.0)
    first, second, *_, last = windows.slices
    assert second.start - first.start == windows.size // 2
    assert 2000 - windows.first - last.stop < windows.size // 2
    np.testing.assert_allclose(windows.starts, [s.start / 50.0 for s in windows.slices])


def test_power_is_averaged_within_each_band_and_nowhere_else(random) -> None:
    windows = Windows.over(2000, 50.0)
    power = random.uniform(1.0, 2.0, (windows.frequencies.size, 3))
    smoothed = windows.smoothed(power)
    for band in set(windows.bands.tolist()):
        inside = windows.bands == band
        np.testing.assert_allclose(smoothed[inside], power[inside].mean(axis=0, keepdims=True).repeat(inside.sum(), 0))
    np.testing.assert_array_equal(smoothed[0], power[0])  # the mean is a band of its own


def test_the_power_of_a_residual_is_its_sum_of_squares_with_the_mean_by_half() -> None:
    residual = np.ones((4, 5, 12), complex)
    np.testing.assert_allclose(power_of(residual), 4 * (0.5 + 4.0))


def test_a_slow_aircraft_is_compared_in_a_narrower_band() -> None:
    wide, narrow = (Windows.over(2000, 50.0, highest=highest) for highest in (4.0, 1.3))
    assert narrow.frequencies[-1] <= 1.3 < narrow.frequencies[-1] + 1.0 / narrow.length
    np.testing.assert_array_equal(narrow.frequencies, wide.frequencies[: narrow.frequencies.size])
    series = np.sin(np.arange(2000) / 7.0)
    np.testing.assert_allclose(
        narrow.transform(series), wide.transform(series)[:, : narrow.frequencies.size], atol=1e-12
    )
