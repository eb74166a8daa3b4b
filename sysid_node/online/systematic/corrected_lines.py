"""The lines of a stretch of flight with what is estimated of the imperfections taken out.

As in ``corrected_signals``, but of the lines themselves: the tests for changes hold stretches of flight against
estimates that were made with corrected signals.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency.fourier_transform import impulse
from sysid_node.online.regression.information import clean_lines_and_rates, edges
from sysid_node.online.regression.instruments import InstrumentModel
from sysid_node.online.regression.least_squares import residual_combinations
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.systematic import servo_model
from sysid_node.online.systematic.column_changes import ColumnChanges
from sysid_node.online.systematic.corrected_signals import corrected_by
from sysid_node.online.systematic.imperfections import Imperfections
from sysid_node.online.systematic.servo_model import ServoModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class CorrectedLines(NamedTuple):
    """Corrected lines of a stretch, and what the errors of the correction do to the residuals in it."""

    lines: Array  # (2F, W) without offset, constant and drift
    errors: Array  # (C, 2F, K) of each coefficient's residual, per standard deviation of K independent errors


@dataclass(frozen=True)
class LineCorrection:
    """What is taken out of lines, whose controls are where the ``servos`` have them, and how far it is known."""

    imperfect: Imperfections
    changes: ColumnChanges  # by one unit of each imperfection
    servos: ServoModel
    estimate: Array  # (K,) of the imperfections, to be taken out
    covariance: Array  # (K, K) of the imperfections
    jacobian: Array  # (K, C, P) what they do to the slopes of C coefficients

    def correct(
        self,
        transform: Array,
        model: InstrumentModel | None,
        omega: Array,
        ends: tuple[float, float],
        equations: NormalEquations,
        theta: Array,
    ) -> CorrectedLines:
        """Correct the transform (2F + 1, W) of a stretch between two ``ends`` (s).

        ``omega``: (F,) rad/s. ``theta`` (P, C) are the slopes whose residuals are looked at. What impulses at both ends
        have in the lines is taken out: rates are j omega times the lines but for them.
        """
        own = self._all_lines(transform, model, omega, ends)
        rates: Complex = 1j * omega[:, None] * own
        both: Complex = np.concatenate([own, rates], axis=1)  # (F, 2N)
        matrix, place = corrected_by(self.changes, self.estimate), self.imperfect.places
        found = _stacked(both @ matrix[place].T)
        v = np.zeros((self.changes.columns.width, theta.shape[1]))
        v[place] = residual_combinations(equations, theta)
        direct = (v.T @ self.changes.signals).swapaxes(0, 1)  # (C, K, 2N) of the residuals by each imperfection
        # imperfections that are others would have made the slopes others, too
        by_slopes = self.jacobian.swapaxes(0, 1) @ matrix[place[equations.columns]]
        values, vectors = np.linalg.eigh(self.covariance)
        each = (vectors * np.sqrt(np.maximum(values, 0.0))).T @ (direct - by_slopes)  # (C, K, 2N)
        return CorrectedLines(found, _stacked(both @ each.swapaxes(1, 2)))

    def _all_lines(
        self, transform: Array, model: InstrumentModel | None, omega: Array, ends: tuple[float, float]
    ) -> Complex:
        """(F, N) clean lines of all signals that corrections are made of (``ServoColumns``)."""
        layout, columns, F = self.changes.layout, self.changes.columns, omega.size
        impulses = edges(*(impulse(omega, end) for end in ends))
        clean = clean_lines_and_rates(transform, model, impulses, omega, layout.differentiated)
        clean = np.delete(clean, np.s_[layout.transformed : layout.width], axis=1)
        lines = np.zeros((F, columns.width), dtype=complex)
        lines[:, : columns.transformed] = clean[:F] + 1j * clean[F:]
        rates = lines[:, layout.rates]
        lines[:, columns.servos] = servo_model.rate_gain(self.servos, omega) * np.concatenate([rates, rates], axis=1)
        if model is not None and model.gains.shape[1]:
            lines[:, columns.instruments] = (model.gains @ lines[:, model.controls, None])[..., 0]
        if columns.integrals:
            lines[:, columns.instruments.stop :] = columns.integral_gain(omega) * lines[:, columns.integrands]
        return lines


def _stacked(lines: Complex) -> Array:
    """(..., 2F, W) real and imaginary parts of lines (..., F, W)."""
    return np.concatenate([lines.real, lines.imag], axis=-2)
