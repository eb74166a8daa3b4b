"""Filters for measured signals: derivatives, low-pass filtering, block averages."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from sysid_node.flight.record import Array, FlightRecord, uninterrupted_parts

_INTERRUPTION = 0.1  # s: no slope is taken across a longer step


def pieces(time: Array) -> list[slice]:
    """The parts of a flight between interruptions: steps of more than five usual ones, and of more than 0.1 s."""
    return uninterrupted_parts(time, _INTERRUPTION)


def differentiate(time: Array, x: Array, half_width: int = 2, degree: int = 4) -> Array:
    """The derivative (N,) of ``x`` (N,) at each time, s, by local polynomials on ``2 half_width + 1`` samples.

    The samples may be unevenly spaced. Two samples either side and degree 4 give the fourth-order central difference
    (no smoothing, no bias in the band of flight); a wider window or a lower degree smooths (Savitzky & Golay, 1964;
    Klein & Morelli, 2006, sec. 11.2). The ends are
    extended by point reflection. No slope is taken across an interruption (``pieces``), either side of which is an end,
    and a sample alone between two of them has none: NaN.
    """
    parts = [_slope(time[part], x[part], half_width, degree) for part in pieces(time)]
    return np.concatenate(parts)


def _slope(time: Array, x: Array, half_width: int, degree: int) -> Array:
    """The derivative of a part without interruptions, on fewer samples where it has few."""
    if time.size < 2:
        return np.full(time.size, np.nan)
    h = min(half_width, time.size - 1)
    degree = min(degree, 2 * h)
    t = np.concatenate([2.0 * time[0] - time[h:0:-1], time, 2.0 * time[-1] - time[-2 : -h - 2 : -1]])
    y = np.concatenate([2.0 * x[0] - x[h:0:-1], x, 2.0 * x[-1] - x[-2 : -h - 2 : -1]])
    around = sliding_window_view(t, 2 * h + 1) - time[:, None]
    scale = np.abs(around).max(axis=1, keepdims=True)
    basis = (around / scale)[:, :, None] ** np.arange(degree + 1)
    gram = np.swapaxes(basis, 1, 2) @ basis
    moments = np.swapaxes(basis, 1, 2) @ sliding_window_view(y, 2 * h + 1)[:, :, None]
    slope: Array = np.linalg.solve(gram, moments)[:, 1, 0] / scale[:, 0]
    return slope


def lowpass(time: Array, X: Array, cutoff: float) -> Array:
    """``X`` (N, p) low-pass filtered at ``cutoff`` Hz without delay.

    A Butterworth filter of second order runs forwards and backwards: -6 dB at ``cutoff``, 24 dB/octave above. The same
    filter on both sides of an equation changes none of its parameters. ``X`` comes back unchanged where ``cutoff`` is 0
    or not below half the sampling rate. The time steps are assumed to be equal.
    """
    rate = 1.0 / float(np.median(np.diff(time)))
    if not 0.0 < cutoff < 0.5 * rate:
        return X
    from scipy.signal import butter, sosfiltfilt  # noqa: PLC0415  # importing it takes half a second

    sections = butter(2, cutoff, fs=rate, output="sos")
    return np.asarray(sosfiltfilt(sections, X, axis=0, padlen=min(len(X) - 1, int(3 * rate / cutoff))))


def noise_gain(time: Array, cutoff: float) -> float:
    """The share of white noise's variance that ``lowpass`` lets through."""
    impulse = np.zeros((time.size, 1))
    impulse[time.size // 2] = 1.0
    return float(np.sum(lowpass(time, impulse, cutoff) ** 2))


def averaging_factor(record: FlightRecord, rate: float) -> int:
    """The number of samples averaged into one for ``rate`` Hz or a little more; 1 where ``rate`` is 0 or not lower."""
    step = float(np.median(np.diff(record.time)))
    return max(1, int(1.0 / (rate * step) + 1e-6)) if rate > 0.0 else 1


def block_averaged(record: FlightRecord, rate: float) -> FlightRecord:
    """The record at ``rate`` Hz or a little more, each sample the mean of those that it replaces; 0 changes nothing.

    A mean over a missing value is missing. The means of states and inputs satisfy the equations of motion only as far
    as both are nearly linear over a block.
    """
    factor = averaging_factor(record, rate)
    if factor < 2 or len(record) < 2 * factor:
        return record
    whole = len(record) // factor * factor

    def mean(values: Array) -> Array:
        return np.asarray(values[:whole].reshape(-1, factor).mean(axis=1))

    columns = {name: mean(values) for name, values in record.columns.items()}
    return FlightRecord(mean(record.time), columns, record.name, record.start_ns, record.rejected)
