"""Orthogonal phase-optimised multisines: all surfaces at once, each with different harmonics, with low peaks.

Morelli, "Multiple Input Design for Real-Time Parameter Estimation in the Frequency Domain", IFAC SYSID (2003); Klein &
Morelli, "Aircraft System Identification" (2006), sect. 9.3. Phases minimise the p-norm for growing p (Guillaume,
Schoukens, Pintelon & Kollar, IEEE Trans. Instrum. Meas. 40 (1991)), from Schroeder's phases and from random ones.
"""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from sysid_node.errors import InputError

Array = NDArray[np.float64]
Harmonics = NDArray[np.int64]

#: Samples per period of the highest harmonic: to optimise phases, and to find the peak.
_COARSE, _FINE = 16, 64
_RANDOM_STARTS = 5
_POWERS = (4, 8, 16, 32, 64, 128)
_MOST_HARMONICS = 2000


def harmonics(length: float, low: float, high: float) -> Harmonics:
    """The numbers k of the harmonics k / length from ``low`` to ``high`` (Hz). Raises InputError without any."""
    numbers = np.arange(max(1, int(np.ceil(low * length - 1e-9))), int(np.floor(high * length + 1e-9)) + 1)
    if numbers.size == 0:
        raise InputError(
            f"no harmonic of 1/{length:g} s lies between {low:g} and {high:g} Hz; widen the band or fly longer"
        )
    if numbers.size > _MOST_HARMONICS:
        raise InputError(
            f"{numbers.size} harmonics of 1/{length:g} s lie between {low:g} and {high:g} Hz, more than "
            f"{_MOST_HARMONICS}; narrow the band or repeat a shorter manoeuvre"
        )
    return numbers


def multisine(time: Array, length: float, low: float, high: float, count: int) -> Array:
    """``count`` multisines of period ``length`` (s), (count, N), peak one each, over one period from time zero.

    The harmonics in the band go to the inputs in turn, so the inputs are orthogonal over the period; each begins
    and ends at zero. Raises InputError where an input would have no harmonic.
    """
    numbers = harmonics(length, low, high)
    if numbers.size < count:
        raise InputError(
            f"{numbers.size} harmonics of 1/{length:g} s between {low:g} and {high:g} Hz for {count} controls; "
            "widen the band or fly longer"
        )
    waves = []
    for i in range(count):
        of_input = numbers[i::count]
        phase = np.array(optimal_phases(tuple(of_input.tolist())))
        wave, peak = sum_of_sines(time / length, of_input, np.ones(of_input.size), phase)
        waves.append(np.where((time >= 0) & (time <= length + 1e-9), wave / peak, 0.0))
    return np.array(waves)


def sum_of_sines(period: Array, numbers: Harmonics, amplitude: Array, phase: Array) -> tuple[Array, float]:
    """The wave at ``period`` (N,), in periods of the fundamental, and a bound on its peak, 0.1 % high at most."""
    wave = amplitude @ np.sin(2 * np.pi * numbers[:, None] * period + phase[:, None])
    # between samples the wave rises above them by no more than this factor (Ehlich & Zeller, Math. Z. 86 (1964))
    bound = np.abs(over_period(numbers, amplitude, phase, _FINE)).max() / np.cos(np.pi / _FINE)
    return wave, float(bound)


def over_period(numbers: Harmonics, amplitude: Array, phase: Array, density: int = _COARSE) -> Array:
    """The wave over one period of the fundamental, ``density`` samples to each period of the highest harmonic."""
    count = density * int(numbers[-1])
    spectrum = np.zeros(count // 2 + 1, dtype=complex)
    spectrum[numbers] = -0.5j * count * amplitude * np.exp(1j * phase)
    return np.fft.irfft(spectrum, count)


def relative_peak_factor(wave: Array) -> float:
    """(max - min) / (2 sqrt(2) rms): 1 for a sine, less is flatter (Klein & Morelli, eq. 9.31)."""
    return float((wave.max() - wave.min()) / (2 * np.sqrt(2) * np.sqrt(np.mean(wave**2))))


@lru_cache(maxsize=64)
def optimal_phases(numbers: tuple[int, ...]) -> tuple[float, ...]:
    """Phases (rad) of unit sines of these harmonics with the least relative peak factor found, starting at zero.

    Deterministic: the random starts are seeded.
    """
    k = np.array(numbers)
    flat = np.ones(k.size)
    generator = np.random.default_rng(0)
    starts = [_schroeder(k.size)] + [generator.uniform(0, 2 * np.pi, k.size) for _ in range(_RANDOM_STARTS)]
    found = [_flatten(k, start) for start in starts]
    best = min(found, key=lambda phase: relative_peak_factor(over_period(k, flat, phase)))
    return tuple(to_zero_crossing(k, flat, best).tolist())


def to_zero_crossing(numbers: Harmonics, amplitude: Array, phase: Array) -> Array:
    """The phases shifted in time to an upward zero crossing, so that the wave begins and ends at zero."""
    wave = over_period(numbers, amplitude, phase)
    i = int(np.flatnonzero((wave <= 0) & (np.roll(wave, -1) > 0))[0])
    after = wave[(i + 1) % wave.size]
    shift = 2 * np.pi * (i - wave[i] / (after - wave[i])) / wave.size
    for _ in range(20):  # Newton's method, from less than a sample away
        value = amplitude @ np.sin(numbers * shift + phase)
        shift -= value / ((amplitude * numbers) @ np.cos(numbers * shift + phase))
    return np.asarray(np.mod(phase + numbers * shift, 2 * np.pi))


def _schroeder(count: int) -> Array:
    """Schroeder's phases of a flat spectrum (IEEE Trans. Inf. Theory 16 (1970))."""
    i = np.arange(count)
    return -np.pi * i * (i + 1) / count


def _flatten(numbers: Harmonics, phase: Array) -> Array:
    """The phases that minimise the p-norm of the wave, for p = 4, 8, ... in turn, each started at the last."""
    for power in _POWERS:
        norm = partial(_norm, numbers=numbers, power=power)
        phase = minimize(norm, phase, jac=True, method="L-BFGS-B", options={"maxiter": 200}).x
    return phase


def _norm(phase: Array, numbers: Harmonics, power: int) -> tuple[float, Array]:
    """Logarithm of the p-norm of the wave of unit sines, and its gradient by the phases."""
    wave = over_period(numbers, np.ones(numbers.size), phase)
    scale = np.abs(wave).max()
    ratio = wave / scale
    mean = np.mean(ratio**power)
    slope = ratio ** (power - 1) / (scale * wave.size * mean)
    # sum over samples of slope times the derivative cos(k angle + phase), by the transform of the slope
    gradient = np.real(np.exp(1j * phase) * np.conj(np.fft.rfft(slope)[numbers]))
    return float(np.log(scale) + np.log(mean) / power), gradient
