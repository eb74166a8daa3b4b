"""Residuals by window and frequency as weighted real rows of a least-squares problem, and their likelihood.

The residual of a channel is modelled as Gaussian noise whose power spectrum is constant within each band. Its weights
are therefore the inverse square roots of that power, which is the residual's own, but never below the noise of the
sensors.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import INDEPENDENT_SHARE, Complex


def weights(power: Array) -> Array:
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


def residual_power(model: ResidualModel, residual: Complex, theta: Array) -> Array:
    """Power (L, 12) of a residual (W, L, 12), averaged within each band, and at least the sensors' noise.

    What the noise has more or less at the parameters (P,) than at the file's is taken off. Channels that were not
    measured have a power of one.
    """
    return _with_noise_of_file(model, (np.abs(residual) ** 2).mean(axis=0), theta)


def spectral_deviance(model: ResidualModel, power: Array, theta: Array) -> float:
    """Minus twice the log likelihood, up to a constant, of a residual whose mean power by line is ``power`` (L, 12).

    The noise spectrum is profiled out: it is the smoothed power itself (the Whittle likelihood at its maximum). What
    the noise has more or less at the parameters (P,) than at the file's is taken off.
    """
    floor = _with_noise_of_file(model, power, theta)
    left = power - model.excess_noise(theta)
    return model.windows.count * float(np.sum(line_shares(model) * (np.log(floor) + left / floor)))


def excess_squares(model: ResidualModel, power: Array, theta: Array, windows: int) -> Array:
    """What noise at parameters (P,) beyond that at the file's adds to the squares of weighted rows, by channel (12,).

    ``power`` (L, 12) is that of which the weights are, ``windows`` the number of windows.
    """
    return np.asarray(windows * np.sum(line_shares(model) * model.excess_noise(theta) / power * model.axes, axis=0))


def noise_gradient(model: ResidualModel, power: Array, theta: Array, indices: Sequence[int], windows: int) -> Array:
    """Half the slope (K,) of the sum of ``excess_squares`` with respect to these entries of the parameters (P,).

    It is the gradient by which least squares of weighted rows is corrected for the noise of the regressors.
    """
    pull = np.zeros(len(theta))
    if model.gain is not None:
        weight = line_shares(model) / power * model.axes
        pull[model.gain.indices] = 0.5 * windows * np.einsum("lc,lcj->j", weight, model.gain.slope(theta))
    return np.asarray(pull[list(indices)])


def line_shares(model: ResidualModel) -> Array:
    """Independent real parts (L, 1) of each line, in halves of its amplitude's two: zero frequency has one."""
    lines = np.full((model.noise.shape[0], 1), 2.0 * INDEPENDENT_SHARE)
    lines[0] *= 0.5
    return lines


def _with_noise_of_file(model: ResidualModel, power: Array, theta: Array) -> Array:
    """Power (L, 12) averaged within each band as it would be with the noise at the file's parameters."""
    smoothed = model.windows.smoothed(power) - model.excess_noise(theta)
    return np.where(model.axes, np.maximum(smoothed, model.noise), 1.0)
