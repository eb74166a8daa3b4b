"""The covariance of a weighted least-squares estimate with coloured residuals.

Klein & Morelli, "Aircraft System Identification" (2006), eq. 6.45 (output error) and 5.63 (equation error); after
Morelli & Klein, "Accuracy of Aerodynamic Model Parameters Estimated from Flight Test Data", JGCD 20(1), 1997:

    Cov = D [ sum_i sum_j S_i' R_vv(i - j) S_j ] D,   D = (sum_i S_i' S_i)^-1

with S_i the sensitivities and v_i the residuals at sample i, both divided by the noise level. Three things differ from
the paper. The double sum is evaluated in the frequency domain, where it is a single sum. The autocorrelation of the
residuals, between all channels, passes a Parzen lag window (Parzen, 1957), so that no variance can be negative. And the
part of the noise that the fit has absorbed is restored, because the residuals are smaller than the noise exactly where
the regressors have power: E[V V^H] = F - H F - F H^H + S C S^H with H = S D S^H, at every frequency, solved for F.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from sysid_node.flight.record import Array

Complex = NDArray[np.complex128]

#: Longest lag of the autocorrelation as a share of the longest record: long enough for slow residuals, while the
#: spectrum keeps some 25 degrees of freedom.
LAG_SHARE = 0.15

#: Degrees of freedom of a Parzen spectrum per record length over lag width (Priestley, 1981, table 6.1).
_PARZEN_FREEDOM = 3.709

#: Fixed-point iterations that restore what the fit has absorbed; a third changes no digit that counts.
_ITERATIONS = 2


def spectral_degrees_of_freedom(lengths: Sequence[int]) -> float:
    """Equivalent degrees of freedom of the residuals' spectrum, for records of these lengths in samples."""
    return _PARZEN_FREEDOM * sum(lengths) / _lag_width(max(lengths))


def coloured_covariance(
    inverse_information: Array,
    sensitivities: Sequence[Array],
    residuals: Sequence[Array],
    instruments: Sequence[Array] | None = None,
    iterations: int = _ITERATIONS,
) -> Array:
    """Covariance (P, P) of estimates with residuals of any colour.

    ``inverse_information`` (P, P) is the covariance that would hold for white residuals of unit variance;
    ``sensitivities`` (N, ny, P) and ``residuals`` (N, ny) of each manoeuvre are divided by the noise level of each
    output and are zero where nothing was measured. Residuals are uncorrelated between manoeuvres. ``instruments``
    (N, ny, P) are what the residuals were made orthogonal to, where these are not the sensitivities themselves (least
    squares in a band of frequencies: the sensitivities within that band). ``iterations`` restore the noise that the fit
    has absorbed; 0 is the paper's formula.
    """
    size = next_fast_len(2 * max(len(r) for r in residuals), real=True)
    width = _lag_width(max(len(r) for r in residuals))
    slopes = [rfft(s, size, axis=0) for s in sensitivities]
    transforms = slopes if instruments is None else [rfft(s, size, axis=0) for s in instruments]
    pairs = _pair_counts(residuals)
    periodogram = np.sum([_periodogram(r, size) for r in residuals], axis=0) / pairs
    spectrum = _smooth(periodogram, size, width)
    leverage = (
        np.sum([_projected(s, inverse_information, t) for s, t in zip(slopes, transforms, strict=True)], axis=0) / pairs
    )
    for _ in range(iterations):
        covariance = inverse_information @ _inner(transforms, spectrum, size) @ inverse_information
        absorbed = leverage @ spectrum
        absorbed = absorbed + np.conj(np.swapaxes(absorbed, 1, 2))
        fitted = np.sum([_projected(s, covariance, s) for s in slopes], axis=0) / pairs
        spectrum = _smooth(periodogram + absorbed - fitted, size, width)
    covariance = inverse_information @ _inner(transforms, spectrum, size) @ inverse_information
    return 0.5 * (covariance + covariance.T)


def _lag_width(samples: int) -> int:
    return max(2, int(LAG_SHARE * samples))


def _pair_counts(residuals: Sequence[Array]) -> Array:
    """The number of samples (ny, ny) at which each pair of channels was measured together; at least 1."""
    masks = [(residual != 0.0).astype(np.float64) for residual in residuals]
    counts: Array = np.maximum(np.sum([mask.T @ mask for mask in masks], axis=0), 1.0)
    return counts


def _periodogram(residual: Array, size: int) -> Complex:
    """V(f) V(f)^H (F, ny, ny) of one manoeuvre."""
    transform = rfft(residual, size, axis=0)
    product: Complex = transform[:, :, None] * transform.conj()[:, None, :]
    return product


def _projected(left: Complex, matrix: Array, right: Complex) -> Complex:
    """S(f) M Z(f)^H (F, ny, ny)."""
    product: Complex = (left @ matrix) @ np.conj(np.swapaxes(right, 1, 2))
    return product


def _smooth(periodogram: Complex, size: int, width: int) -> Complex:
    """The spectrum smoothed by Parzen's lag window of ``width`` samples."""
    lag = np.minimum(np.arange(size), size - np.arange(size)) / width
    window = np.where(lag <= 0.5, 1.0 - 6.0 * lag**2 + 6.0 * lag**3, 2.0 * np.clip(1.0 - lag, 0.0, None) ** 3)
    smoothed: Complex = rfft(irfft(periodogram, size, axis=0) * window[:, None, None], axis=0)
    return smoothed


def _inner(transforms: Sequence[Complex], spectrum: Complex, size: int) -> Array:
    """sum_i sum_j S_i' R(i - j) S_j (P, P), over all manoeuvres."""
    weight = np.full(size // 2 + 1, 2.0)  # the negative frequencies are the conjugates of the positive ones
    weight[0] = 1.0
    if size % 2 == 0:
        weight[-1] = 1.0
    parts = [
        np.tensordot(s.conj(), (spectrum @ s) * weight[:, None, None], axes=([0, 1], [0, 1])).real for s in transforms
    ]
    total: Array = np.sum(parts, axis=0) / size
    return total
