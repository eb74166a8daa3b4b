"""Residuals by window and frequency as weighted real rows of a least-squares problem, and their likelihood.

The residual of a channel is modelled as Gaussian noise whose power spectrum is constant within each band. Its weights
are therefore the inverse square roots of that power, which is the residual's own, but never below the noise of the
sensors.
"""

from __future__ import annotations

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import INDEPENDENT_SHARE, Complex, Windows


def weights(windows: Windows, power: Array) -> Array:
    """Weights (2 L, 12) of the real parts, then of the imaginary parts, for noise of a power (L, 12).

    The line at zero frequency has no imaginary part.
    """
    real = np.sqrt(2.0 * INDEPENDENT_SHARE / power)
    real[0] *= np.sqrt(0.5)
    imaginary = real.copy()
    imaginary[0] = 0.0
    return np.concatenate([real, imaginary])


def real_rows(amplitudes: Complex, weight: Array) -> Array:
    """Complex amplitudes (W, L, 12, ...) as weighted real rows (W, R, ...), R = 2 L 12."""
    parts = np.concatenate([amplitudes.real, amplitudes.imag], axis=1)
    parts = parts * weight.reshape(1, *weight.shape, *(1,) * (parts.ndim - 3))
    return np.asarray(parts.reshape(parts.shape[0], -1, *parts.shape[3:]))


def amplitudes(rows: Array, weight: Array) -> Complex:
    """Complex amplitudes (W, L, 12) of weighted real rows (W, R): the inverse of ``real_rows``."""
    parts = rows.reshape(rows.shape[0], 2, -1, len(CHANNELS))
    weight = weight.reshape(2, -1, len(CHANNELS))
    raw = np.where(weight > 0, parts / np.where(weight > 0, weight, 1.0), 0.0)
    return np.asarray(raw[:, 0] + 1j * raw[:, 1])


def residual_power(model: ResidualModel, residual: Complex) -> Array:
    """Power (L, 12) of a residual (W, L, 12), averaged within each band, and at least the sensors' noise.

    Channels that were not measured have a power of one.
    """
    power = model.windows.smoothed((np.abs(residual) ** 2).mean(axis=0))
    return np.where(model.axes, np.maximum(power, model.noise), 1.0)


def spectral_deviance(model: ResidualModel, power: Array) -> float:
    """Minus twice the log likelihood, up to a constant, of a residual whose mean power by line is ``power`` (L, 12).

    The noise spectrum is profiled out: it is the smoothed power itself (the Whittle likelihood at its maximum).
    """
    floor = np.where(model.axes, np.maximum(model.windows.smoothed(power), model.noise), 1.0)
    lines = np.ones((power.shape[0], 1))
    lines[0] = 0.5
    return 2.0 * INDEPENDENT_SHARE * model.windows.count * float(np.sum(lines * (np.log(floor) + power / floor)))
