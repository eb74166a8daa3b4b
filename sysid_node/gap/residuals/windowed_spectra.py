"""Short-time Fourier transform: a time series as complex amplitudes by window and frequency line.

The windows have a sine taper and overlap by half. The squares of neighbouring tapers add up to one, so that every
sample counts once. There are twice as many coefficients as independent ones, so each counts by half
(``INDEPENDENT_SHARE``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.flightdata.time_scales import HIGHEST_FREQUENCY

Complex = NDArray[np.complex128]

#: Approximate length of a window, s: two periods of the middle of the lowest band. Drift stays in a window's mean.
LENGTH = 8.0

#: Least length of a flight, in windows; in a shorter one the windows are shorter.
LEAST_WINDOWS = 3.0

#: Time that is left out at either end of a flight, s, where delayed signals are not known.
MARGIN = 0.25

#: Number of independent coefficients for each coefficient.
INDEPENDENT_SHARE = 0.5

#: Edges of the bands in which the residual's power is averaged, Hz; zero frequency is a band of its own.
BAND_EDGES = (0.0, 0.06, 0.3, 0.6, 1.0, 1.6, 2.4, HIGHEST_FREQUENCY + 0.1)


@dataclass(frozen=True)
class Windows:
    """Windows of ``size`` samples at ``rate`` Hz, ``count`` of them, half a window apart, from ``first`` on.

    Above the frequency ``highest``, Hz, vanes and rigid-body dynamics contain little information.
    """

    rate: float
    size: int
    count: int
    first: int = 0
    highest: float = HIGHEST_FREQUENCY

    @classmethod
    def over(cls, samples: int, rate: float, highest: float = HIGHEST_FREQUENCY) -> Windows:
        """Windows of about ``LENGTH`` s that fill a flight of so many samples except its ends."""
        first = round(MARGIN * rate)
        inner = samples - 2 * first
        halves = max(2, round(2.0 * inner / min(LENGTH * rate, inner / LEAST_WINDOWS)))
        return cls(rate, 2 * (inner // halves), halves - 1, first, highest)

    @property
    def frequencies(self) -> Array:
        """Lines (L,), Hz, from zero."""
        step = self.rate / self.size
        lines: Array = np.asarray(np.arange(int(self.highest / step + 1e-9) + 1) * step, dtype=np.float64)
        return lines

    @property
    def starts(self) -> Array:
        """Time at which each window begins (W,), s."""
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
        """Number of each line's band (L,)."""
        return np.searchsorted(np.array(BAND_EDGES), self.frequencies, side="right") - 1

    def transform(self, series: Array) -> Complex:
        """Amplitudes (W, L, ...) of a series (N, ...), scaled so that white noise keeps its variance."""
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
    """Tapered cosines, then negative sines (2 lines, size). With so few lines a product is faster than an FFT."""
    sample = np.arange(size)
    taper = np.sin(np.pi * (sample + 0.5) / size) / np.sqrt(0.5 * size)
    phase = 2.0 * np.pi * np.outer(np.arange(lines), sample) / size
    return np.concatenate([np.cos(phase) * taper, -np.sin(phase) * taper])


def power_of(residual: Complex) -> Array:
    """Power (12,) of a residual (W, L, 12). The line at zero frequency, which has no imaginary part, counts by half."""
    power = (np.abs(residual) ** 2).sum(axis=0)
    return np.asarray(power.sum(axis=0) - 0.5 * power[0])
