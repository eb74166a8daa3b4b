"""What a stretch of flight says: Gram matrices of the transformed signals, and how its noise is correlated.

A record is taken in segments no longer than one period of the line spacing. Within a segment every
signal is taken about its mean, z - k mean(z) / mean(k), which removes the offset k C_0 exactly, and a constant and a straight
drift are projected out (trim, slow drift and transients leak into all lines otherwise);
then the Gram matrices of the segments add up: least squares on their sum is sequential over segments and uses all
that the record holds in the band. On one long transform a coarse grid would skip what lies between its lines, and a
fine one would count the same information twice.

Noise of spectral density S appears in the lines of a transform over a window w with the covariance

    E[X_i X_j^*] = S integral w^2 exp(-j (omega_i - omega_j) t) dt      (and with + for E[X_i X_j])

so neighbouring lines of a short record are far from independent. ``scores`` keeps A' Sigma A with this covariance,
per band of lines: with the residual's density in each band it gives the covariance of the estimates whatever the
grid is (sandwich form: Klein & Morelli 2006, eq. 5.38, with the exact covariance of the finite transform's lines).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.signals import OFFSET, OUTPUTS

Array = NDArray[np.float64]
_N = slice(OFFSET + 1, OFFSET + 3)  # columns of constant and drift
BANDS = 4


@dataclass
class Information:
    """Sums over segments. B bands, W columns of the signal vector."""

    grams: Array  # (B, W, W) sums over the band's lines of the projected signals' products
    scores: Array  # (B, W, W) the same with the noise covariance of unit density in between
    traces: Array  # (B,) expected sum of squares of unit-density noise
    trace_square: float  # of the noise covariance squared, over all lines
    energy: float  # s: integral of the window squared: the duration, where nothing is forgotten
    bias: Array  # (W, W) expected contribution of the sensors' noise to the Gram matrix
    integrals: Array  # (W,) of the signals over time
    samples: float

    def __add__(self, other: Information) -> Information:
        return Information(*(getattr(self, f) + getattr(other, f) for f in self.__dataclass_fields__))

    def scaled(self, factor: float) -> Information:
        """With all that was counted worth ``factor`` as much."""
        return Information(*(getattr(self, f) * factor for f in self.__dataclass_fields__))


def nothing(width: int) -> Information:
    """No information at all."""
    zeros = np.zeros((BANDS, width, width))
    return Information(zeros, zeros.copy(), np.zeros(BANDS), 0.0, 0.0, np.zeros((width, width)), np.zeros(width), 0.0)


def band_edges(lines: int) -> list[slice]:
    """The lines in ``BANDS`` runs of about equal length."""
    edges = np.linspace(0, lines, BANDS + 1).round().astype(int)
    return [slice(int(a), int(b)) for a, b in zip(edges, edges[1:], strict=False)]


def about_mean(transform: Array) -> Array:
    """(2F, W) lines of a transform (2F + 1, W) whose signals are taken about their means; nuisances are kept.

    The noise of the airspeed is in k: fitting the offset to the lines of k would be a regression on noise. The means know better.
    """
    share = transform[-1] / max(float(transform[-1, OFFSET]), 1e-12)
    share[OFFSET : OFFSET + 3] = 0.0
    return transform[:-1] - transform[:-1, OFFSET, None] * share


def project(lines: Array) -> Array:
    """(2F, W) with constant and drift projected out of the other columns; they themselves are kept."""
    n = lines[:, _N]
    gram = n.T @ n
    clean = lines - n @ (inverse2(gram) @ (n.T @ lines))
    clean[:, _N] = n
    return clean


def inverse2(gram: Array) -> Array:
    """Inverse of a symmetric 2 x 2 matrix; of its first element alone where the second column brings nothing."""
    a, b, d = float(gram[0, 0]), float(gram[0, 1]), float(gram[1, 1])
    det = a * d - b * b
    if det > 1e-12 * a * d:
        return np.array([[d, -b], [-b, a]]) / det
    return np.array([[1.0 / a if a > 0.0 else 0.0, 0.0], [0.0, 0.0]])


def noise_covariance(omega: Array, begin: float, end: float, memory: float) -> Array:
    """(2F, 2F) covariance of the stacked real and imaginary parts for noise of unit spectral density.

    Window exp(-(end - t) / 2 memory) on begin..end (s).
    """
    rate = 1.0 / memory if math.isfinite(memory) else 0.0
    late, early = np.exp(-1j * omega * end), np.exp(-1j * omega * begin) * math.exp(-0.5 * rate * (end - begin))

    def window(other_late: Array, other_early: Array, difference: Array) -> Array:
        # integral of exp(-rate (end - t)) exp(-j d t) dt
        exponent = rate - 1j * difference
        small = np.abs(exponent) * (end - begin) < 1e-6
        value = late[:, None] * other_late - early[:, None] * other_early
        return np.where(small, end - begin, value / np.where(small, 1.0, exponent))

    minus = window(late.conj(), early.conj(), omega[:, None] - omega)
    plus = window(late, early, omega[:, None] + omega)
    real, imaginary = 0.5 * (minus + plus), 0.5 * (minus - plus)
    cross = 0.5 * (plus.imag - minus.imag)
    return np.block([[real.real, cross], [cross.T, imaginary.real]])


def window_energy(duration: float, memory: float) -> float:
    """Integral of the window squared over a stretch of ``duration`` (s)."""
    return memory * -math.expm1(-duration / memory) if math.isfinite(memory) else duration


def measure(transform: Array, omega: Array, begin: float, end: float, memory: float) -> Information:
    """What the transform (2F + 1, W) of begin..end (s) says; ``bias`` and ``samples`` are left at zero."""
    F = omega.size
    clean = project(about_mean(transform))
    covariance = noise_covariance(omega, begin, end, memory)
    spread = covariance @ clean
    n = clean[:, _N]
    hat = n @ inverse2(n.T @ n)
    # what projecting the nuisances out takes from the noise's sum of squares: diagonal of H K
    taken = np.einsum("ij,ij->i", hat, spread[:, _N])
    info = nothing(clean.shape[1])
    for band, edge in enumerate(band_edges(F)):
        for part in (edge, slice(F + edge.start, F + edge.stop)):
            info.grams[band] += clean[part].T @ clean[part]
            info.scores[band] += clean[part].T @ spread[part]
            info.traces[band] += np.trace(covariance[part, part]) - taken[part].sum()
    info.scores += info.scores.transpose(0, 2, 1).copy()
    info.scores *= 0.5
    info.trace_square = float(np.vdot(covariance, covariance))
    info.energy = window_energy(end - begin, memory)
    info.integrals = transform[-1].copy()
    return info
