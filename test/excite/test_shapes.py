"""Shapes: the values that their definitions give, peaks of one, spectra in their bands."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import welch

from sysid_node.excite.shapes import multistep, ramp, random, sweep


@pytest.mark.parametrize("rate", [50, 100, 200, 400])
def test_3211_switches_where_it_should(rate):
    """At every rate the steps hold 3, 2, 1 and 1 widths of samples, though 0.3 s is not exact in binary."""
    time = np.arange(5 * rate) / rate
    wave = multistep(time - 0.7, (3, 2, 1, 1), 0.3)
    expected = np.zeros(time.size)
    edge = [round((0.7 + 0.3 * n) * rate) for n in (0, 3, 5, 6, 7)]
    for sign, (start, stop) in zip((1, -1, 1, -1), pairwise(edge), strict=True):
        expected[start:stop] = sign
    assert np.array_equal(wave, expected)


def test_spectra_of_doublet_and_3211_peak_where_the_textbook_says():
    """Energy of a doublet of step w peaks near 0.37/w Hz; a 3-2-1-1 is wider: its half-power band is at least twice
    as wide, relative to its centre (Plaetschke & Schulz 1979; Jategaonkar, 2nd ed., sect. 2.4)."""
    time = np.arange(0, 100, 0.01)
    frequency = np.fft.rfftfreq(time.size, 0.01)

    def band(pattern):
        energy = np.abs(np.fft.rfft(multistep(time, pattern, 1.0))) ** 2
        half = frequency[energy > 0.5 * energy.max()]
        return frequency[energy.argmax()], half.min(), half.max()

    peak, low, high = band((1, 1))
    _, wide_low, wide_high = band((3, 2, 1, 1))
    assert peak == pytest.approx(0.371, abs=0.01)  # tan(pi f w) = 2 pi f w
    assert wide_high / wide_low > 1.5 * high / low


def test_ramp():
    assert np.allclose(ramp(np.array([-1, 0, 5, 10, 15, 20, 21]), 20.0), [0, 0, 1, 0, -1, 0, 0])


def test_sweep_covers_its_band_and_nothing_else():
    time = np.arange(0, 60, 0.01)
    wave = sweep(time, 60.0, 0.2, 3.0)
    assert np.abs(wave).max() == pytest.approx(1.0, abs=1e-3)
    frequency, density = welch(wave, fs=100.0, nperseg=2048)
    assert density[(frequency > 0.15) & (frequency < 3.3)].sum() / density.sum() > 0.97
    assert wave[0] == 0.0
    assert abs(wave[-1]) < 1e-3


def test_frequency_of_the_sweep_grows_from_low_to_high():
    time = np.arange(0, 60, 0.001)
    wave = sweep(time, 60.0, 0.2, 3.0)
    crossings = time[np.flatnonzero((wave[:-1] < 0) & (wave[1:] >= 0))]
    frequency, middle = 1 / np.diff(crossings), 0.5 * (crossings[:-1] + crossings[1:])
    expected = 0.2 + 2.8 * np.expm1(4 * middle / 60) / np.expm1(4)
    assert np.allclose(frequency, expected, rtol=0.01)
    assert frequency[-1] == pytest.approx(3.0, rel=0.05)


def test_random_is_band_limited_seeded_and_of_peak_one():
    time = np.arange(2000) / 100.0
    wave = random(time, 20.0, 0.5, 2.0, seed=3)
    amplitude = np.abs(np.fft.rfft(wave))
    frequency = np.fft.rfftfreq(time.size, 0.01)
    outside = (frequency < 0.5 - 1e-9) | (frequency > 2.0 + 1e-9)
    assert amplitude[outside].max() < 1e-9 * amplitude.max()
    assert 0.98 < np.abs(wave).max() <= 1.0
    assert abs(wave[0]) < 1e-9
    assert np.array_equal(wave, random(time, 20.0, 0.5, 2.0, seed=3))
    assert np.abs(np.corrcoef(wave, random(time, 20.0, 0.5, 2.0, seed=4))[0, 1]) < 0.5


def test_random_is_flat_on_average():
    """Mean power of the lines over 400 seeds is the same within four of its standard errors (exponential: 1/sqrt n)."""
    time = np.arange(1000) / 50.0
    lines = np.arange(10, 41)
    waves = [random(time, 20.0, 0.5, 2.0, seed) for seed in range(400)]
    power = np.array([np.abs(np.fft.rfft(wave / np.std(wave))[lines]) ** 2 for wave in waves])
    mean = power.mean(axis=0)
    assert np.all(np.abs(mean / mean.mean() - 1) < 4 / np.sqrt(400))
