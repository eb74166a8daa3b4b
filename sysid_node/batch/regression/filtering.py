"""Filters for measured signals: derivatives, low-pass, averages."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.signal import butter, sosfiltfilt

from sysid_node.flight.record import Array, FlightRecord


def differentiate(time: Array, x: Array, half_width: int = 2, degree: int = 4) -> Array:
    """Derivative (N,) of ``x`` (N,) at each time, s, by a polynomial fitted to the ``2 half_width + 1`` samples around.

    Works at the samples' own times. Two samples either side and degree 4 give the fourth-order central difference
    (no smoothing, no bias in the band of flight); a wider window or a lower degree smooths (Savitzky & Golay, 1964;
    Klein & Morelli, 2006, sec. 11.2). The ends are continued by point reflection.
    """
    h = half_width
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
    """``X`` (N, p) without what is above ``cutoff`` Hz, undelayed (Butterworth, both ways: -6 dB there, 24 dB/octave).

    The same filter on both sides of an equation changes none of its constants. Unchanged where ``cutoff`` is 0, or not
    below half the sampling rate; the time steps are taken to be equal.
    """
    rate = 1.0 / float(np.median(np.diff(time)))
    if not 0.0 < cutoff < 0.5 * rate:
        return X
    sections = butter(2, cutoff, fs=rate, output="sos")
    return np.asarray(sosfiltfilt(sections, X, axis=0, padlen=min(len(X) - 1, int(3 * rate / cutoff))))


def averaging_factor(record: FlightRecord, rate: float) -> int:
    """How many samples make one at ``rate`` Hz or a little above; 1 where ``rate`` is 0 or the flight is slower."""
    step = float(np.median(np.diff(record.time)))
    return max(1, int(1.0 / (rate * step) + 1e-6)) if rate > 0.0 else 1


def block_averaged(record: FlightRecord, rate: float) -> FlightRecord:
    """The record at ``rate`` Hz or a little above, each sample the mean of those it replaces; 0 leaves it as it is.

    A mean over a missing value is missing. Means of states and inputs belong together only as far as both are nearly
    straight lines for so long.
    """
    together = averaging_factor(record, rate)
    if together < 2 or len(record) < 2 * together:
        return record
    whole = len(record) // together * together

    def mean(values: Array) -> Array:
        return np.asarray(values[:whole].reshape(-1, together).mean(axis=1))

    columns = {name: mean(values) for name, values in record.columns.items()}
    return FlightRecord(mean(record.time), columns, record.name, record.start_ns, record.rejected)
