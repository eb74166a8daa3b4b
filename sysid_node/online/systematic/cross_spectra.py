"""Cross-spectral matrices of the transformed signals: sufficient for the normal equations of any linear change of them.

Per line, S_ij = sum over segments of conj(X_i) X_j. It adds up over segments and fades like the Gram matrices, whose
sum over the lines' real parts it is; but as it keeps the phases, the Gram matrix after any filtering of any signal
follows from it: nothing is transformed again, and no samples are kept. T signals are transformed; behind them stand the
m controls' changes with their servos' lateness, and the I instruments, which are made of the controls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression.instruments import InstrumentModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

NO_SPECTRA: Complex = np.zeros((0, 0, 0), dtype=complex)


def cross_spectra(clean: Array, transformed: int) -> Complex:
    """(F, T, T) of the clean lines (2F, W) of a segment, whose controls are where the servos have them."""
    F = clean.shape[0] // 2
    X = clean[:F, :transformed] + 1j * clean[F:, :transformed]
    return np.asarray(X.conj()[:, :, None] * X[:, None, :])


@dataclass(frozen=True)
class ServoColumns:
    """Where things stand in the signals that ``with_servos`` makes."""

    transformed: int  # T
    servos: slice  # of the m controls' changes with lateness
    instruments: slice
    width: int

    @classmethod
    def of(cls, layout: SignalLayout) -> ServoColumns:
        """Those of a signal vector's ``layout``."""
        T, m, made = layout.transformed, len(layout.timed), len(layout.instrumented)
        return cls(T, slice(T, T + m), slice(T + m, T + m + made), T + m + made)

    def place(self, column: int) -> int:
        """Where a column of the signal vector stands."""
        return column if column < self.transformed else column + self.servos.stop - self.servos.start


def with_servos(
    spectra: Complex, columns: ServoColumns, model: InstrumentModel, omega: Array, rate_gain: Complex | None
) -> Complex:
    """(F, N, N) of ``columns``: controls as the ``model``'s servos move them, and its instruments.

    ``rate_gain`` (F, m): see ``servo_model.rate_gain``; None leaves zeros.
    """
    F, T, N = spectra.shape[0], columns.transformed, columns.width
    found = np.zeros((F, N, N), dtype=complex)
    found[:, :T, :T] = spectra
    controls, rates = model.controls, model.rates
    _fill(found[:, :, :T], controls, rates, columns, model, omega, rate_gain)
    across = found.transpose(0, 2, 1).conj()
    _fill(across, controls, rates, columns, model, omega, rate_gain)
    return np.asarray(across.transpose(0, 2, 1).conj())


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
        rows[:, columns.servos] = rate_gain.conj()[:, :, None] * rows[:, rates]
    if model.gains.shape[1]:
        rows[:, columns.instruments] = model.gains.conj() @ rows[:, controls]


def moments(spectra: Complex, omega: Array) -> Array:
    """(2N, 2N) Gram matrix of N signals and, behind them, of their rates: j omega times their lines."""
    F, N, _ = spectra.shape
    flat = spectra.reshape(F, N * N)
    plain, second = (np.stack([np.ones(F), omega**2]) @ flat.real).reshape(2, N, N)
    first = (-omega @ flat.imag).reshape(N, N)
    return np.block([[plain, first], [first.T, second]])


def band_grams(spectra: Complex, bands: tuple[slice, ...], kept: NDArray[np.intp]) -> Array:
    """(B, W, W) Gram matrices of the ``kept`` (W,) signals by bands of lines."""
    real = spectra.real
    return np.array([real[band].sum(axis=0)[np.ix_(kept, kept)] for band in bands])
