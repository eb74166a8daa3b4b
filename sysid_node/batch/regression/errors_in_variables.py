"""Errors in variables: the effect of the air data's noise on a regression, and its correction.

Noise on a regressor adds its own variance to the normal equations and pulls the estimates towards zero. That variance
is subtracted as far as it is known: Fuller, "Measurement Error Models" (1987), sec. 2.2 and, for variances that change
from sample to sample, sec. 3.1. Noise of the airspeed multiplies whole coefficients, so that the residuals are largest
where the information is. A standard error for residuals of constant variance is then too small (White, Econometrica
48, 1980).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.fft import rfft
from scipy.linalg import eigh

from sysid_node.flight.record import Array

#: Octaves above the band in use in which the noise level is read, where the aircraft hardly responds.
_OCTAVES = 3
#: Least number of spectral lines for the level of an octave.
_FEWEST_LINES = 20
#: Share of every regressor's information that the correction leaves at least.
_LEAST_LEFT = 0.5


def white_noise_variance(time: Array, x: Array, cutoff: float) -> float:
    """The variance per sample of the white noise that ``x`` (N,) at ``time`` (N,) s shows above ``cutoff`` Hz.

    It is a lower estimate. The power of the aircraft's motion falls there by a factor of four with each octave, or
    faster (the gusts' spectra as slowly as that, MIL-F-8785C). Two neighbouring octaves of levels L and M therefore
    hold white noise of at least (4 M - L) / 3, and no octave holds less than the noise. Interpolation of slow air data
    lowers the level of high octaves, so only a few are looked at. Levels are medians of the periodogram, which a line
    of vibration does not move. Above half the Nyquist frequency, aliases hide how the motion's power falls. The result
    is zero where nothing is sampled above ``cutoff``.
    """
    window = np.hanning(x.size)
    power = np.abs(rfft((x - x.mean()) * window)) ** 2 / np.sum(window**2)
    line = 1.0 / (x.size * float(np.median(np.diff(time))))
    edges = np.ceil(cutoff * 2.0 ** np.arange(_OCTAVES + 1) / line).astype(int)
    octaves = [power[a:b] for a, b in pairwise(edges) if b <= power.size // 2 and b - a >= _FEWEST_LINES]
    levels = [float(np.median(octave) / np.log(2.0)) for octave in octaves]
    bounds = [(4.0 * upper - lower) / 3.0 for lower, upper in pairwise(levels)]
    return min(*levels, max(0.0, *bounds)) if bounds else 0.0


@dataclass(frozen=True)
class SensorNoise:
    """One sensor's white noise in a regression on one flight.

    ``variance`` of each sample, in the reading's unit squared. ``of_measured`` (N,) and ``of_regressors`` (N, p): the
    derivatives of the measured coefficient and of its regressors with respect to the reading.
    """

    variance: float
    of_measured: Array
    of_regressors: Array


@dataclass(frozen=True)
class ErrorsInVariables:
    """All sensors' noise in a regression on one flight.

    The normal equations are X' B (y - X theta) = 0 with a filter B: ``scores`` (N, p) = B X, ``weight`` the diagonal
    element of B.
    """

    scores: Array
    weight: float
    noises: Sequence[SensorNoise]

    def expected_moments(self) -> Array:
        """What the noise adds to X' B [X y], on average (p, p + 1)."""
        parts = [
            noise.variance
            * self.weight
            * noise.of_regressors.T
            @ np.column_stack([noise.of_regressors, noise.of_measured])
            for noise in self.noises
        ]
        return np.asarray(np.sum(parts, axis=0))

    def heteroskedasticity(self, theta: Array) -> Array:
        """The scores' covariance (p, p) less that of the same noise power spread evenly over the flight."""
        total = np.zeros((theta.size, theta.size))
        for noise in self.noises:
            power = noise.variance * (noise.of_measured - noise.of_regressors @ theta) ** 2
            total += (self.scores * (power - power.mean())[:, None]).T @ self.scores
        return total


def corrected_normal_equations(
    information: Array, moment: Array, flights: Sequence[ErrorsInVariables]
) -> tuple[Array, Array]:
    """Information (p, p) and moment (p,) without what the noise of the ``flights`` adds on average.

    Where that would leave next to no information, only a share is subtracted. The largest share follows from the
    smallest root of |A - lambda S| = 0: Fuller (1987), sec. 2.5.
    """
    expected = np.sum([flight.expected_moments() for flight in flights], axis=0)
    added = 0.5 * (expected[:, :-1] + expected[:, :-1].T)
    scale = np.sqrt(np.clip(np.diag(information), 0.0, None))
    if not np.all(scale > 0.0):
        return information, moment
    sizes = np.outer(scale, scale)
    try:
        largest = float(eigh(added / sizes, information / sizes, eigvals_only=True)[-1])
    except np.linalg.LinAlgError:  # collinear regressors: there is nothing to correct
        return information, moment
    share = min(1.0, (1.0 - _LEAST_LEFT) / largest) if largest > 0.0 else 0.0
    return information - share * added, moment - share * expected[:, -1]


def inflated_covariance(covariance: Array, inverse: Array, theta: Array, flights: Sequence[ErrorsInVariables]) -> Array:
    """The covariance (p, p) with the share of heteroskedastic noise; no variance becomes smaller.

    ``inverse`` (p, p) is that of the information, ``theta`` (p,) the estimates.
    """
    extra = inverse @ np.sum([flight.heteroskedasticity(theta) for flight in flights], axis=0) @ inverse
    variance = np.diag(covariance)
    ratio = np.divide(np.diag(extra), variance, out=np.zeros_like(variance), where=variance > 0.0)
    growth = np.sqrt(1.0 + np.clip(ratio, 0.0, None))
    return np.asarray(covariance * np.outer(growth, growth))
