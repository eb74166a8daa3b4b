"""How much noise the vanes have, by the aircraft file and by what the flight shows.

Noise on a regressor biases its slope towards zero, which is corrected for where data are learned from and where they
are tested (bias-compensated least squares: Soderstrom, Automatica 43, 2007, sec. 5). A correction for noise that a vane
does not have would do harm. The noise is therefore the file's, but at most what the flight's residuals leave room for.
In some blocks it is at most a share of that: where the readings vary by less from one block to the next, or where the
force agrees with them better. The vane is jammed then, or better than the file says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults.state import MonitorState, WhitenedBlock
from sysid_node.online.frequency.regression_signals import OFFSET

Array = NDArray[np.float64]

#: Vanes: column of a block's air data, and the coefficient that depends on their angle.
VANES = {"alpha": (1, COEFFICIENTS.index("CL")), "beta": (2, COEFFICIENTS.index("CY"))}
_GAIN = 20.0  # of a third difference: 1 + 9 + 9 + 1
_CHANCE = 2.0  # times the mean square of some twenty differences that the noise's may be
LEAST = 1e-14  # rad^2, variance of a vane's noise that counts at least: far below any vane's


class VaneReadings(NamedTuple):
    """What blocks say of a vane, rad: its readings (N,), and errors (N,) of them that would explain the force's.

    These follow from the residuals of the reference model, and from the innovations with what was learned since, scaled
    so that white noise of the vane alone would have its own variance.
    """

    read: Array
    by_residual: Array
    by_innovation: Array

    def first(self, count: int) -> VaneReadings:
        """The same of the first blocks."""
        return VaneReadings(*(series[:count] for series in self))

    def share(self, variance: float) -> float:
        """The share of a noise of this ``variance`` (rad^2) that there is room for.

        The third difference of the readings holds the noise, with ``_GAIN`` times its variance, and little motion.
        """
        differences = np.diff(self.read, 3)
        errors = (float(series.var(ddof=1)) for series in (self.by_residual, self.by_innovation))
        return min(1.0, min(_CHANCE * float(np.mean(differences**2)) / _GAIN, *errors) / variance)


def slopes(state: MonitorState) -> dict[str, float]:
    """The derivative of each vane's force by its angle. What was learned since is too little to matter here."""
    found = {}
    for vane, (_, output) in VANES.items():
        mine = np.flatnonzero((state.terms.output == output) & state.terms.of(vane))
        if mine.size:
            found[vane] = float(state.reference.values[mine[0]])
    return found


def noise_variances(state: MonitorState, samples: float, variances: Array) -> dict[str, float]:
    """Variance (rad^2) of each vane's noise in a block of so many ``samples``.

    It is the file's, and at most that of innovations with these ``variances`` (6,).
    """
    found = {}
    for vane, slope in slopes(state).items():
        output = VANES[vane][1]
        taps = state.whitening.filter[:, output]
        most = float(variances[output]) / slope**2 / (1.0 + float(taps @ taps))
        found[vane] = max(min(state.aircraft.noise[vane] ** 2 / samples, most), LEAST)
    return found


def readings(state: MonitorState, pieces: Sequence[WhitenedBlock], shift: Array) -> dict[str, VaneReadings]:
    """Of each vane in these blocks, by the reference model with its values shifted (D,)."""
    found = {}
    for vane, slope in slopes(state).items():
        column, output = VANES[vane]
        taps = state.whitening.filter[:, output]
        size = state.whitening.unmix[output, output] * slope * np.sqrt(1.0 + taps @ taps)
        read = np.array([piece.block.air[column] for piece in pieces])
        off = np.array([piece.residual[output] / piece.block.regressors[OFFSET] for piece in pieces])
        left = np.array([piece.whitened[output] for piece in pieces])
        left -= np.array([piece.design[output] for piece in pieces]) @ shift
        found[vane] = VaneReadings(read, off / slope, left / size)
    return found


def shares(known: Mapping[str, VaneReadings], variances: Mapping[str, float]) -> dict[str, float]:
    """The share of its noise with one of these ``variances`` (rad^2) that each vane has room for."""
    return {vane: one.share(variances[vane]) for vane, one in known.items()}
