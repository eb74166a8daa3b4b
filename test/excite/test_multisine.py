"""Multisines: orthogonal, flat in the band and nothing outside, with peaks no higher than Morelli's method finds."""

import numpy as np
import pytest

from sysid_node.errors import InputError
from sysid_node.excite.multisine import harmonics, multisine, optimal_phases, over_period, relative_peak_factor

LENGTH, RATE = 20.0, 100.0
TIME = np.arange(round(LENGTH * RATE)) / RATE  # one period, its end left out

# Relative peak factors of Morelli's method (2003; SIDPAC's mkmsswp: Schroeder's phases, then 50 simplex searches on the
# relative peak factor), run on these harmonics of 1/20 s sampled at 50 Hz.
MORELLI = {
    tuple(range(2, 20, 3)): 1.309,
    tuple(range(2, 30, 3)): 1.165,
    tuple(range(2, 41, 3)): 1.153,
    tuple(range(2, 41, 2)): 1.064,
    tuple(range(3, 41)): 1.061,
}


@pytest.mark.parametrize("numbers", MORELLI, ids=len)
def test_relative_peak_factor_is_at_most_morellis(numbers):
    k = np.array(numbers)
    wave = over_period(k, np.ones(k.size), np.array(optimal_phases(numbers)), density=64)
    assert relative_peak_factor(wave) <= MORELLI[numbers]


def test_a_single_sine_has_a_relative_peak_factor_of_one():
    assert relative_peak_factor(np.sin(2 * np.pi * np.arange(1000) / 1000)) == pytest.approx(1.0, abs=1e-4)


def test_inputs_are_orthogonal_at_every_lag():
    """Each input has different harmonics: the cross-correlation over a period vanishes not only at lag zero."""
    waves = multisine(TIME, LENGTH, 0.1, 2.0, 3)
    spectra = np.fft.rfft(waves)
    power = np.sqrt(np.mean(waves**2, axis=1))
    for i in range(3):
        for j in range(i):
            correlation = np.fft.irfft(spectra[i] * np.conj(spectra[j])) / TIME.size
            assert np.abs(correlation).max() < 1e-12 * power[i] * power[j]


def test_spectrum_is_flat_on_its_harmonics_and_empty_elsewhere():
    waves = multisine(TIME, LENGTH, 0.1, 2.0, 3)
    amplitudes = np.abs(np.fft.rfft(waves)) / TIME.size
    for i, amplitude in enumerate(amplitudes):
        numbers = np.arange(2, 41)[i::3]
        assert np.ptp(amplitude[numbers]) < 1e-12
        assert np.delete(amplitude, numbers).max() < 1e-12


def test_begins_and_ends_at_zero_and_stays_within_one():
    fine = np.linspace(-1.0, LENGTH + 1.0, 50_001)
    waves = multisine(fine, LENGTH, 0.1, 2.0, 2)
    assert np.all(waves[:, (fine < 0) | (fine > LENGTH + 1e-6)] == 0)
    assert np.abs(multisine(np.array([0.0, LENGTH]), LENGTH, 0.1, 2.0, 2)).max() < 1e-9
    peaks = np.abs(waves).max(axis=1)
    assert np.all(peaks <= 1.0)
    assert np.all(peaks > 0.99)


def test_is_the_same_every_time():
    first = np.array(optimal_phases(tuple(range(3, 20))))
    optimal_phases.cache_clear()
    assert np.array_equal(first, optimal_phases(tuple(range(3, 20))))


def test_a_band_without_harmonics_is_an_error():
    with pytest.raises(InputError, match=r"no harmonic of 1/0.4 s lies between 0.1 and 2 Hz"):
        harmonics(0.4, 0.1, 2.0)
    with pytest.raises(InputError, match=r"2 harmonics of 1/10 s between 0.1 and 0.2 Hz for 3 controls"):
        multisine(TIME, 10.0, 0.1, 0.2, 3)
    with pytest.raises(InputError, match="more than 2000"):
        harmonics(1e5, 0.1, 2.0)


def test_band_edges_are_included():
    assert harmonics(20.0, 0.1, 2.0).tolist() == list(range(2, 41))
    assert harmonics(30.0, 0.1, 0.3).tolist() == list(range(3, 10))
