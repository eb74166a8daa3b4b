"""Windows and lines: a time series as complex amplitudes by window and frequency.

Sine-tapered windows that overlap by half: the squares of neighbouring tapers add up to one, so that every sample counts
once; the coefficients, twice as many as there are independent ones, each count by half (``SHARE``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array

Complex = NDArray[np.complex128]

#: Length of a window, about, s: two periods of the lowest band's middle, short enough that drift stays in its mean.
LENGTH = 8.0

#: Lengths of a window that fit into the shortest flight.
LEAST_WINDOWS = 3.0

#: What is left out at either end of a flight, s: late signals are made up there, by holding the first or last sample.
MARGIN = 0.25

#: Highest line, Hz: beyond it, vanes and rigid-body dynamics have little to say.
HIGHEST_FREQUENCY = 4.0

#: What each coefficient counts of an independent one.
INDEPENDENT_SHARE = 0.5

#: Edges of the bands in which the residual's power is smoothed, Hz; the mean is a band of its own.
BAND_EDGES = (0.0, 0.06, 0.3, 0.6, 1.0, 1.6, 2.4, HIGHEST_FREQUENCY + 0.1)


@dataclass(frozen=True)
class Windows:
    """Windows of ``size`` samples at ``rate`` Hz, ``count`` of them, half a window apart, from ``first`` on."""

    rate: float
    size: int
    count: int
    first: int = 0

    @classmethod
    def over(cls, samples: int, rate: float, length: float = LENGTH) -> Windows:
        """As many of about this length as fill so many samples without their ends."""
        first = round(MARGIN * rate)
        inner = samples - 2 * first
        halves = max(2, round(2.0 * inner / min(length * rate, inner / LEAST_WINDOWS)))
        return cls(rate, 2 * (inner // halves), halves - 1, first)

    @property
    def frequencies(self) -> Array:
        """Lines (L,), Hz, from zero."""
        step = self.rate / self.size
        lines: Array = np.asarray(np.arange(int(HIGHEST_FREQUENCY / step + 1e-9) + 1) * step, dtype=np.float64)
        return lines

    @property
    def starts(self) -> Array:
        """When each window begins (W,), s."""
        return (self.first + np.arange(self.count) * (self.size // 2)) / self.rate

    @property
    def slices(self) -> list[slice]:
        """Samples of each window."""
        begins = [self.first + i * (self.size // 2) for i in range(self.count)]
        return [slice(begin, begin + self.size) for begin in begins]

    @property
    def length(self) -> float:
        """Length of a window, s."""
        return self.size / self.rate

    @property
    def bands(self) -> NDArray[np.intp]:
        """Band of each line (L,)."""
        return np.searchsorted(np.array(BAND_EDGES), self.frequencies, side="right") - 1

    def transform(self, series: Array) -> Complex:
        """Amplitudes (W, L, ...) of a series (N, ...); the variance of white noise passes as it is per sample."""
        lines = self.frequencies.size
        table, flat = _tapered_waves(self.size, lines), series.reshape(series.shape[0], -1)
        parts = np.stack([table @ flat[window] for window in self.slices])
        amplitudes: Complex = parts[:, :lines] + 1j * parts[:, lines:]
        return amplitudes.reshape(self.count, lines, *series.shape[1:])

    def smoothed(self, power: Array) -> Array:
        """Power (L, A) averaged within each band."""
        _, bands = np.unique(self.bands, return_inverse=True)
        means = np.stack([power[bands == b].mean(axis=0) for b in range(bands.max() + 1)])
        return np.asarray(means[bands])


@lru_cache(maxsize=8)
def _tapered_waves(size: int, lines: int) -> Array:
    """Cosines, then negative sines (2 lines, size) under the taper: few lines are wanted, so a product beats an FFT."""
    sample = np.arange(size)
    taper = np.sin(np.pi * (sample + 0.5) / size) / np.sqrt(0.5 * size)
    phase = 2.0 * np.pi * np.outer(np.arange(lines), sample) / size
    return np.concatenate([np.cos(phase) * taper, -np.sin(phase) * taper])


def power_of(residual: Complex) -> Array:
    """Power (12,) of a residual (W, L, 12); the mean, which has no imaginary part, counts half."""
    power = (np.abs(residual) ** 2).sum(axis=0)
    return np.asarray(power.sum(axis=0) - 0.5 * power[0])
