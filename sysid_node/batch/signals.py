"""Time derivatives of measured signals."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from sysid_node.flight.record import Array


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
