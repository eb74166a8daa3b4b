"""Cross-spectral matrices of the transformed signals: sufficient for the normal equations of any linear change of them.

Per line, S_ij = sum over segments of conj(X_i) X_j. It adds up over segments and fades like the Gram matrices, whose
sum over the lines' real parts it is; but as it keeps the phases, the Gram matrix after any filtering of any signal
follows from it: nothing is transformed again, and no samples are kept. T signals are transformed, some of which are
rates of others; behind them stand the m controls' changes with their servos' lateness, the I instruments, which are
made of the controls, and, where no vanes measure the flow angles, J integrals of which the reconstructed angles are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression.instruments import InstrumentModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: What is integrated where no vanes are, and how often.
INTEGRATED = (("p", 1), ("q", 1), ("r", 1), ("CL", 1), ("CY", 1), ("p", 2))


def cross_spectra(clean: Array) -> Complex:
    """(F, T, T) of the clean lines (2F, T) of a segment, whose controls are where the servos have them."""
    F = clean.shape[0] // 2
    X = clean[:F] + 1j * clean[F:]
    return np.asarray(X.conj()[:, :, None] * X[:, None, :])


@dataclass(frozen=True)
class ServoColumns:
    """Where things stand in the signals that ``with_servos`` makes."""

    transformed: int  # T, of which the last are rates of others
    rates: slice  # of the rates
    servos: slice  # of the m controls' changes with lateness, and behind them of these changes' second derivatives
    instruments: slice
    integrals: Mapping[tuple[str, int], int]  # places of integrals, by signal and how often it is integrated
    integrands: tuple[int, ...]  # (J,) places of these signals
    width: int

    @classmethod
    def of(cls, layout: SignalLayout, *, integrals: bool = False) -> ServoColumns:
        """Those of a signal vector's ``layout``; with ``integrals``, where no vanes are."""
        W, R, m, made = layout.transformed, len(layout.differentiated), len(layout.timed), len(layout.instrumented)
        T = W + R
        S = T + 2 * m
        found = [each for each in INTEGRATED if integrals and each[0] in layout.names]
        places = {each: S + made + j for j, each in enumerate(found)}
        integrands = tuple(layout.column(name) for name, _ in found)
        return cls(T, slice(W, T), slice(T, S), slice(S, S + made), places, integrands, S + made + len(found))

    def integral_gain(self, omega: Array) -> Complex:
        """(F, J) what integrating makes of the signals' lines at ``omega`` (F,) rad/s."""
        orders = np.array([order for _, order in self.integrals], dtype=int)
        return np.asarray((1.0 / (1j * omega[:, None])) ** orders)

    def place(self, column: int) -> int:
        """Where a column of the signal vector stands."""
        first = self.rates.start
        return column if column < first else column - first + self.instruments.start

    def rates_of(self, layout: SignalLayout) -> NDArray[np.intp]:
        """(N,) where the rate of each signal stands among all signals and, behind them, their j omega times."""
        found = self.width + np.arange(self.width)
        found[list(layout.differentiated)] = np.arange(self.rates.start, self.rates.stop)
        found[layout.deflections] = np.arange(layout.rates.start, layout.rates.stop)
        return found


def with_servos(
    spectra: Complex, columns: ServoColumns, model: InstrumentModel, omega: Array, rate_gain: Complex | None
) -> Complex:
    """(F, N, N) of ``columns``: controls as the ``model``'s servos move them, and its instruments.

    ``rate_gain`` (F, 2m): see ``servo_model.rate_gain``; None leaves zeros.
    """
    F, T, N = spectra.shape[0], columns.transformed, columns.width
    found = np.zeros((F, N, N), dtype=complex)
    found[:, :T, :T] = spectra
    controls, rates = model.controls, model.rates
    _fill(found[:, :, :T], controls, rates, columns, model, omega, rate_gain)
    across = np.conjugate(found.transpose(0, 2, 1), order="C")
    _fill(across, controls, rates, columns, model, omega, rate_gain)
    return np.asarray(across)  # which is Hermitian by now


def _fill(
    rows: Complex,
    controls: slice,
    rates: slice,
    columns: ServoColumns,
    model: InstrumentModel,
    omega: Array,
    rate_gain: Complex | None,
) -> None:
    """Change the rows (F, N, .) of the controls, and make those of servos and instruments; rows are conjugated."""
    if model.servos is not None:
        more = model.servos.conj()[:, :, None] * rows[:, rates]
        rows[:, controls] += more
        rows[:, rates] += (-1j * omega)[:, None, None] * more
    if rate_gain is not None:
        both = np.concatenate([rows[:, rates], rows[:, rates]], axis=1)
        rows[:, columns.servos] = rate_gain.conj()[:, :, None] * both
    if model.gains.shape[1]:
        rows[:, columns.instruments] = model.gains.conj() @ rows[:, controls]
    if columns.integrals:
        gain = columns.integral_gain(omega).conj()
        rows[:, columns.instruments.stop :] = gain[:, :, None] * rows[:, columns.integrands]


def band_moments(spectra: Complex, omega: Array, bands: tuple[slice, ...]) -> Array:
    """(B, 2N, 2N) Gram matrices by bands of N signals and, behind them, of their rates: j omega times their lines."""
    F, N, _ = spectra.shape
    flat = np.ascontiguousarray(spectra).view(np.float64).reshape(F, 2 * N * N)
    weights, found = np.stack([np.ones(F), -omega, omega**2]), np.empty((len(bands), 2 * N, 2 * N))
    for moments, band in zip(found, bands, strict=True):
        plain, first, second = (weights[:, band] @ flat[band]).reshape(3, N, N, 2)
        moments[:N, :N], moments[N:, N:] = plain[..., 0], second[..., 0]
        moments[:N, N:], moments[N:, :N] = first[..., 1], first[..., 1].T
    return found


def band_grams(spectra: Complex, bands: tuple[slice, ...], kept: NDArray[np.intp]) -> Array:
    """(B, W, W) Gram matrices of the ``kept`` (W,) signals by bands of lines."""
    real = spectra.real
    return np.array([real[band].sum(axis=0)[np.ix_(kept, kept)] for band in bands])
