"""Amplitude spectra for the report, from samples at their own times."""

from __future__ import annotations

import numpy as np

from sysid_node.flight.record import Array


def amplitude_spectrum(time: Array, signals: Array, frequency: Array) -> Array:
    """Root mean square, over segments of the record, of the amplitude at each frequency (Welch 1967).

    ``time`` (N,) s, increasing; ``signals`` (N, M), finite; ``frequency`` (F,) Hz, evenly spaced. Returns (F, M) in the
    signals' units: a sinusoid in the middle of every segment shows its peak amplitude. Segments overlap by half, are
    Hann-windowed, and last one period of the frequencies' spacing (the whole record where that is shorter), so that
    neighbouring frequencies hold different information whatever the length of the record.
    """
    duration = float(time[-1] - time[0])
    spacing = float(frequency[1] - frequency[0]) if frequency.size > 1 else 0.0
    length = min(1.0 / spacing, duration) if spacing > 0 else duration
    count = max(int(2 * duration / length) - 1, 1)
    starts = time[0] + np.linspace(0.0, duration - length, count)
    power = np.zeros((frequency.size, signals.shape[1]))
    used = 0
    for start in starts:
        rows = slice(*np.searchsorted(time, [start, start + length], side="left"))
        if rows.stop - rows.start > 2:
            power += _power(time[rows], signals[rows], frequency, start, length)
            used += 1
    return np.sqrt(power / max(used, 1))


def _power(time: Array, signals: Array, frequency: Array, start: float, length: float) -> Array:
    """Squared amplitudes (F, M) of one segment, each sample weighted by the window and its time step."""
    window = np.sin(np.pi * (time - start) / length) ** 2
    weight = window * np.gradient(time)
    total = weight.sum()
    centred = signals - weight @ signals / total
    waves = np.exp(-2j * np.pi * np.outer(frequency, time))
    return np.asarray((2.0 * np.abs((waves * weight) @ centred) / total) ** 2)
