"""How the power of the sensors' noise in the residual depends on the parameters.

The forces and moments that a simulator predicts from a measured flow contain the flow's noise, multiplied by the
derivatives. Derivatives that are all a third too small make this part of the residual a third smaller at every
frequency, beside what they explain: least squares on noisy regressors is biased toward zero. The noise in the residual
is linear in the derivatives, so its power is a quadratic form of them. It is measured from realisations of the noise,
and what it adds at a parameter vector beyond the aircraft file's is taken off the residual's power (corrected least
squares: Fuller (1987), Measurement Error Models, sect. 1.2 and 2.2; the corrected score of Nakamura (1990),
Biometrika 77(1)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.residuals.windowed_spectra import Complex, Windows

#: Effects whose parameters change how much of the measured flow's noise is in the predicted forces and moments.
_EFFECTS = ("derivative_error.", "inertia_error.", "mass_error.", "turbulence.rotation")


@dataclass(frozen=True, eq=False)
class NoiseGain:
    """Power of the noise in the residual of one flight, L lines in B bands, as a quadratic form of J parameters."""

    indices: NDArray[np.intp]  # (J,) entries of the parameter vector
    neutral: Array  # (J,) where the aircraft file has them
    form: Array  # (B, 12, J + 1, J + 1) of (1, changes of the parameters)
    bands: NDArray[np.intp]  # (L,) band of each line

    def excess(self, theta: Array) -> Array:
        """Power (L, 12) that the noise has at parameters (P,) beyond that which it has at the aircraft file's.

        It is negative where derivatives are smaller than the file's.
        """
        change = theta[self.indices] - self.neutral
        linear, quadratic = self.form[..., 0, 1:], self.form[..., 1:, 1:]
        return np.asarray((2.0 * linear @ change + (quadratic @ change) @ change)[self.bands])

    def slope(self, theta: Array) -> Array:
        """Derivatives (L, 12, J) of ``excess`` with respect to the parameters."""
        change = theta[self.indices] - self.neutral
        return np.asarray(2.0 * (self.form[..., 0, 1:] + self.form[..., 1:, 1:] @ change)[self.bands])


def noisy_parameters(names: tuple[str, ...]) -> NDArray[np.intp]:
    """Entries (J,) of the parameter vector on which the power of the noise depends."""
    return np.array([i for i, name in enumerate(names) if name.startswith(_EFFECTS)], np.intp)


def gain_from(windows: Windows, parts: Complex, indices: NDArray[np.intp], neutral: Array, most: Array) -> NoiseGain:
    """The gain from what realisations of the noise leave in the residual, and in its slopes.

    ``parts`` (n, L, 12, J + 1) are the residual's and its slopes' changes by the noise, of n windows of all
    realisations. ``most`` (L, 12) is the power of the measured residual at the file's parameters: a file that states
    more noise than there is overstates all of the form by as much.
    """
    _, bands = np.unique(windows.bands, return_inverse=True)
    first = np.searchsorted(bands, np.arange(bands.max() + 1))
    by_line = np.einsum("nlcj,nlck->lcjk", parts.conj(), parts, optimize=True).real / len(parts)
    form = windows.smoothed(by_line)[first]
    stated = np.maximum(form[..., 0, 0], 1e-300)
    form *= np.minimum(windows.smoothed(most)[first] / stated, 1.0)[..., None, None]
    return NoiseGain(indices, neutral[indices], form, bands)
