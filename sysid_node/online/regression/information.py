"""What a stretch of flight says: Gram matrices of the transformed signals, and how its noise is correlated.

A record is taken in segments no longer than one period of the line spacing. Within a segment every signal is taken
about its mean, z - k mean(z) / mean(k), which removes the offset k C_0 exactly, and a constant and a straight drift are
projected out (trim, slow drift and transients leak into all lines otherwise); then the Gram matrices of the segments
add up: least squares on their sum is sequential over segments and uses all that the record holds in the band. On one
long transform a coarse grid would skip what lies between its lines, and a fine one would count the same information
twice.

Noise of spectral density S appears in the lines of a transform over a window w with the covariance

    E[X_i X_j^*] = S integral w^2 exp(-j (omega_i - omega_j) t) dt      (and with + for E[X_i X_j])

so neighbouring lines of a short record are far from independent. ``scores`` keeps A' Sigma A with this covariance, per
band of lines: with the residual's density in each band it gives the covariance of the estimates whatever the grid is
(sandwich form: Klein & Morelli 2006, eq. 5.38, with the exact covariance of the finite transform's lines).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dger

from sysid_node.online.frequency.regression_signals import OFFSET, SignalLayout
from sysid_node.online.regression.heteroskedasticity import NoiseMoments
from sysid_node.online.regression.instruments import InstrumentModel, fill_in

Array = NDArray[np.float64]
_N = slice(OFFSET + 1, OFFSET + 3)  # columns of constant and drift
_NUISANCES = slice(OFFSET, OFFSET + 3)
BANDS = 6
#: Share of an impulse's energy that is not another's, under which both are one.
ALIKE = 1e-3
#: Share of the drift's energy that is not the constant's, under which it brings nothing.
INDEPENDENT = 1e-12


@dataclass
class Information:
    """Sums over segments. B bands, W columns of the signal vector."""

    grams: Array  # (B, W, W) sums over the band's lines of the projected signals' products
    scores: Array  # (B, W, W) the same with the noise covariance of unit density in between
    traces: Array  # (B,) expected sum of squares of unit-density noise
    trace_square: float  # of the noise covariance squared, over all lines
    energy: float  # s: integral of the window squared: the duration, where nothing is forgotten
    bias: Array  # (W, W) expected contribution of the sensors' noise to the Gram matrix
    integrals: Array  # (W,) of the transformed signals over time
    samples: float
    noise_moments: NoiseMoments = field(default_factory=NoiseMoments)
    #: (F, T, T) see ``systematic.cross_spectra``; empty where nothing is uncertain but noise.
    spectra: NDArray[np.complex128] = field(default_factory=lambda: np.zeros((0, 0, 0), dtype=complex))

    def __add__(self, other: Information) -> Information:
        return Information(*(getattr(self, f) + getattr(other, f) for f in self.__dataclass_fields__))

    def scaled(self, factor: float) -> Information:
        """With all that was counted worth ``factor`` as much."""
        return Information(*(getattr(self, f) * factor for f in self.__dataclass_fields__))


def nothing(layout: SignalLayout, lines: int = 0) -> Information:
    """No information at all; ``lines``: how many have cross-spectra."""
    width, T = layout.width, layout.transformed + len(layout.differentiated) if lines else 0
    zeros = np.zeros((BANDS, width, width))
    bias, none = np.zeros((width, width)), np.zeros(width)
    spectra = np.zeros((lines, T, T), dtype=complex)
    return Information(zeros, zeros.copy(), np.zeros(BANDS), 0.0, 0.0, bias, none, 0.0, spectra=spectra)


def with_grams(info: Information, grams: Array) -> Information:
    """The information with other Gram matrices (B, W, W).

    The scores, whose noise is correlated between lines, are of the Gram matrices column by column as many times as
    before.
    """
    energies = info.grams.diagonal(axis1=1, axis2=2)
    scores = info.scores.diagonal(axis1=1, axis2=2)
    per_energy = np.divide(np.maximum(scores, 0.0), energies, out=np.zeros_like(energies), where=energies > 0.0)
    root = np.sqrt(per_energy)
    return replace(info, grams=grams, scores=grams * root[:, :, None] * root[:, None, :])


@dataclass(frozen=True)
class Spectrum:
    """What the covariance of the lines needs of their frequencies, computed once."""

    omega: Array  # (F,) rad/s
    bands: tuple[slice, ...]  # lines of each band
    order: NDArray[np.intp]  # (2F,) real and imaginary parts of the lines, band after band
    rate: float  # 1/s: decay of the window's energy
    minus: NDArray[np.complex128]  # (F, F) 1 / (rate - j (omega_i - omega_j)); 0 where that has no inverse
    plus: NDArray[np.complex128]  # (F, F) 1 / (rate - j (omega_i + omega_j))


def _band_edges(omega: Array) -> list[int]:
    """Lines at which the bands begin, and their end: even on a logarithmic scale, no band without a line of its own."""
    F = omega.size
    even = np.searchsorted(omega, np.geomspace(omega[0], omega[-1], BANDS + 1)[1:-1])
    edges = [0]
    for band, edge in enumerate(even.tolist(), start=1):
        edges.append(max(min(max(edge, edges[-1] + 1), F - BANDS + band), 0))
    return [*edges, F]


def spectrum(omega: Array, memory: float) -> Spectrum:
    """Lines omega (F,) rad/s in ``BANDS`` octave-like bands; the window fades with ``memory`` (s)."""
    edges = _band_edges(omega)
    bands = tuple(slice(a, b) for a, b in pairwise(edges))
    rate = 1.0 / memory if math.isfinite(memory) else 0.0
    minus, plus = (rate - 1j * (omega[:, None] + sign * omega) for sign in (-1.0, 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = np.where(np.abs(minus) > 1e-9, 1.0 / minus, 0.0)
    order = np.concatenate([np.r_[part, omega.size + part.start : omega.size + part.stop] for part in bands])
    return Spectrum(omega, bands, order, rate, inverse.astype(np.complex128), (1.0 / plus).astype(np.complex128))


@dataclass(frozen=True)
class Edges:
    """What impulses at both ends of a stretch have in its lines.

    The finite transform of a signal's rate is j omega times the signal's, but for such impulses; so is that of a signal
    that follows another late. Where they are projected out, rates and lags follow from the lines alone.
    """

    lines: Array  # (2, 2F)
    inverse: Array  # (2, 2) of their Gram matrix

    def take_out(self, lines: Array) -> None:
        """Project them out of lines (2F, W)."""
        lines -= self.lines.T @ (self.inverse @ (self.lines @ lines))

    def take_out_of(self, gram: Array, lines: Array) -> None:
        """Project them out of the Gram matrix (W, W) of lines (2F, W)."""
        across = self.lines.dot(lines)
        gram -= across.T.dot(self.inverse.dot(across))


def edges(begin: Array, end: Array) -> Edges:
    """The edges whose impulses are ``begin`` and ``end`` (2F + 1,), as of ``fourier_transform.impulse``."""
    F = begin.size // 2
    found = np.empty((2, 2 * F))
    found[0], found[1] = begin[:-1], end[:-1]
    overlap = float(found[0].dot(found[1])) / F
    left = 1.0 - overlap * overlap
    if left < ALIKE:
        return Edges(found, np.array([[1.0 / F, 0.0], [0.0, 0.0]]))
    share = 1.0 / (F * left)
    return Edges(found, np.array([[share, -overlap * share], [-overlap * share, share]]))


def about_mean(transform: Array, model: InstrumentModel | None, edges: Edges | None = None) -> Array:
    """(..., 2F, W) lines of transforms (..., 2F + 1, W) whose signals are taken about their means, and of instruments.

    The lines are made where the transforms lie, which must be in one piece, signal by signal or line by line. Nuisances
    are kept, but for what they have in common with the ``edges`` which are taken out of all. The airspeed's noise is in
    k: fitting the offset to the lines of k would regress on noise.
    """
    if transform.ndim > 2:
        for one in transform:
            about_mean(one, None)
    else:
        share = transform[-1] / max(float(transform[-1, OFFSET]), 1e-12)
        share[_NUISANCES] = 0.0
        k = transform[:, OFFSET]
        if transform.flags.f_contiguous:  # signal by signal
            dger(-1.0, k, share, a=transform, overwrite_a=True)  # z - k share
        else:
            dger(-1.0, share, k, a=transform.T, overwrite_a=True)
    lines = transform[..., :-1, :]
    if model is not None:
        fill_in(model, lines)
    if edges is not None:
        edges.take_out(lines)
    return lines


def project(lines: Array) -> Array:
    """(..., 2F, W) with constant and drift projected out of the other columns; they themselves are kept."""
    n = lines[..., _N].copy()
    across = n.swapaxes(-1, -2)
    clean: Array = lines - n @ (inverse2(across @ n) @ (across @ lines))
    clean[..., _N] = n
    return clean


def inverse2(gram: Array) -> Array:
    """(..., 2, 2) inverses of symmetric matrices; of the first element alone where the second column brings nothing."""
    rows = []
    for a, b, _, d in gram.reshape(-1, 4).tolist():
        det = a * d - b * b
        if det > INDEPENDENT * a * d:
            rows.append((d / det, -b / det, -b / det, a / det))
        else:
            rows.append((1.0 / a if a > 0.0 else 0.0, 0.0, 0.0, 0.0))
    return np.array(rows).reshape(gram.shape)


def noise_covariance(lines: Spectrum, begin: float, end: float) -> Array:
    """(2F, 2F) covariance of the stacked real and imaginary parts for unit spectral density on begin..end (s)."""
    late = np.exp(-1j * lines.omega * end)
    early = np.exp(-1j * lines.omega * begin - 0.5 * lines.rate * (end - begin))
    # integrals of exp(-rate (end - t)) exp(-j (omega_i -+ omega_j) t) dt
    minus = (late[:, None] * late.conj() - early[:, None] * early.conj()) * lines.minus
    plus = (late[:, None] * late - early[:, None] * early) * lines.plus
    if lines.rate == 0.0:
        np.fill_diagonal(minus, end - begin)
    F = lines.omega.size
    covariance = np.empty((2 * F, 2 * F))
    covariance[:F, :F] = minus.real + plus.real
    covariance[F:, F:] = minus.real - plus.real
    covariance[:F, F:] = plus.imag - minus.imag
    covariance[F:, :F] = covariance[:F, F:].T
    covariance *= 0.5
    return covariance


def window_energy(duration: float, rate: float) -> float:
    """Integral of exp(-rate t) over ``duration`` (s)."""
    return -math.expm1(-rate * duration) / rate if rate else duration


def clean_lines(transform: Array, model: InstrumentModel | None, edges: Edges | None = None) -> Array:
    """(..., 2F, W) lines of transforms (..., 2F + 1, W) without offset, constant and drift, with their instruments."""
    return project(about_mean(transform.copy(), model, edges))


def clean_lines_and_rates(
    transform: Array, model: InstrumentModel | None, edges: Edges, omega: Array, columns: Sequence[int]
) -> Array:
    """(2F, W + R) clean lines of a transform (2F + 1, W), and of the rates of some ``columns`` (R).

    A rate is j omega times the lines, but for impulses at the edges. It is taken before anything is projected out:
    afterwards it would be that of another signal.
    """
    lines = about_mean(transform.copy(), model)
    F, of = omega.size, lines[:, columns]
    rates = np.concatenate([-omega[:, None] * of[F:], omega[:, None] * of[:F]])
    both = np.concatenate([lines, rates], axis=1)
    edges.take_out(both)
    return project(both)


def products(transform: Array, model: InstrumentModel | None, edges: Edges | None = None) -> Array:
    """(W, W) Gram matrix of a transform's (2F + 1, W) clean lines, constant and drift projected out.

    The transform is overwritten.
    """
    lines = about_mean(transform, model)
    gram: Array = lines.T @ lines
    if edges is not None:
        edges.take_out_of(gram, lines)
    _project_out(gram)
    return gram


def _project_out(gram: Array) -> None:
    """Take constant and drift out of a Gram matrix (W, W) where it lies: Gaussian elimination."""
    energies = gram.diagonal()[_N].tolist()
    for n, energy in zip(range(_N.start, _N.stop), energies, strict=True):
        row, left = gram[n].copy(), float(gram[n, n])
        if left > INDEPENDENT * energy:
            dger(-1.0 / left, row, row, a=gram.T, overwrite_a=True)


def measure(
    transform: Array,
    model: InstrumentModel | None,
    lines: Spectrum,
    begin: float,
    end: float,
    edges: Edges | None = None,
) -> Information:
    """What the transform (2F + 1, W) of begin..end (s) says; ``bias``, ``samples``, ``noise_moments``: none."""
    return measure_clean(clean_lines(transform, model, edges), transform[-1], lines, begin, end, edges)


def measure_clean(
    clean: Array, integrals: Array, lines: Spectrum, begin: float, end: float, edges: Edges | None = None
) -> Information:
    """The same of clean lines (2F, W), from which ``edges`` have been taken out, and of the ``integrals`` (W,)."""
    covariance = noise_covariance(lines, begin, end)
    spread = covariance @ clean
    n = clean[:, _N]
    # what projecting the nuisances out leaves of the noise's square in each line: diagonal of (I - H) K
    left = covariance.diagonal() - ((n @ inverse2(n.T @ n)) * spread[:, _N]).sum(axis=1)
    if edges is not None:
        left -= ((covariance @ edges.lines.T) * (edges.lines.T @ edges.inverse)).sum(axis=1)
    W = clean.shape[1]
    grams, scores, traces = np.empty((BANDS, W, W)), np.empty((BANDS, W, W)), np.empty(BANDS)
    clean, spread, left = clean[lines.order], spread[lines.order], left[lines.order]
    for band, part in enumerate(lines.bands):
        rows = slice(2 * part.start, 2 * part.stop)
        grams[band] = clean[rows].T @ clean[rows]
        score = clean[rows].T @ spread[rows]
        scores[band] = 0.5 * (score + score.T)
        traces[band] = left[rows].sum()
    square = float(np.vdot(covariance, covariance))
    energy = window_energy(end - begin, lines.rate)
    return Information(grams, scores, traces, square, energy, np.zeros((W, W)), integrals.copy(), 0.0)
