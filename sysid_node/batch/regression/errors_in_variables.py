"""What the air data's noise does to a regression: it pulls the estimates towards zero, and makes residuals that grow
with the manoeuvre.

Noise on a regressor adds its own variance to the normal equations, which therefore is taken out again, as far as it is
known: Fuller, "Measurement Error Models" (1987), sec. 2.2 and, for variances that change from sample to sample, 3.1.
Noise of the airspeed multiplies whole coefficients: the residual is largest where the information is, and a standard
error for residuals that are alike all along is too short (White, Econometrica 48, 1980).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.fft import rfft
from scipy.linalg import eigh

from sysid_node.flight.record import Array

#: Noise is read off in so many octaves above the band that is used, where the aircraft hardly answers.
_OCTAVES = 3
#: Fewest spectral lines in an octave that tell anything.
_FEWEST_LINES = 20
#: At least this share of every regressor's information is left.
_LEAST_LEFT = 0.5


def white_noise_variance(time: Array, x: Array, cutoff: float) -> float:
    """Variance of each sample of the least white noise that ``x`` (N,) at ``time`` (N,) s shows above ``cutoff`` Hz.

    What moves the aircraft falls off there by a factor of four in power with each octave, or faster (the gusts' spectra
    as slowly as that, MIL-F-8785C), so that two octaves, L and then M, hold white noise of (4 M - L) / 3 or more; and
    no octave holds less than the noise, but where slow air data were interpolated, which is why only so many are looked
    at. Levels are medians of the periodogram, which a line of vibration does not move; above half the Nyquist frequency
    aliases hide how motion falls off. Zero where nothing is sampled up there.
    """
    window = np.hanning(x.size)
    power = np.abs(rfft((x - x.mean()) * window)) ** 2 / np.sum(window**2)
    line = 1.0 / (x.size * float(np.median(np.diff(time))))
    edges = np.ceil(cutoff * 2.0 ** np.arange(_OCTAVES + 1) / line).astype(int)
    octaves = [power[a:b] for a, b in pairwise(edges) if b <= power.size // 2 and b - a >= _FEWEST_LINES]
    levels = [float(np.median(octave) / np.log(2.0)) for octave in octaves]
    claimed = [(4.0 * far - near) / 3.0 for near, far in pairwise(levels)]
    return min(*levels, max(0.0, *claimed)) if claimed else 0.0


@dataclass(frozen=True)
class SensorNoise:
    """One sensor's white noise in a regression on one flight.

    ``variance`` of each sample; ``answer`` (N,) and ``regressors`` (N, p): how both sides depend on the reading.
    """

    variance: float
    response: Array
    regressors: Array


@dataclass(frozen=True)
class ErrorsInVariables:
    """All of it on one flight.

    The normal equations are X' B (y - X theta) = 0 with a filter B: ``scores`` (N, p) = B X, ``weight`` the diagonal
    of B.
    """

    scores: Array
    weight: float
    noises: Sequence[SensorNoise]

    def excess(self) -> Array:
        """What the noise adds to X' B [X y], on average (p, p + 1)."""
        parts = [
            noise.variance * self.weight * noise.regressors.T @ np.column_stack([noise.regressors, noise.response])
            for noise in self.noises
        ]
        return np.asarray(np.sum(parts, axis=0))

    def unevenness(self, theta: Array) -> Array:
        """What the scores' covariance (p, p) is above that of the same noise spread evenly over the flight."""
        total = np.zeros((theta.size, theta.size))
        for noise in self.noises:
            power = noise.variance * (noise.response - noise.regressors @ theta) ** 2
            total += (self.scores * (power - power.mean())[:, None]).T @ self.scores
        return total


def corrected_normal_equations(
    information: Array, moment: Array, noisy: Sequence[ErrorsInVariables]
) -> tuple[Array, Array]:
    """Information (p, p) and moment (p,) without what the noise has added; less where that would leave next to nothing.

    The share that can be taken out is that of Fuller (1987), sec. 2.5: the smallest root of |A - lambda S| = 0.
    """
    excess = np.sum([flight.excess() for flight in noisy], axis=0)
    added = 0.5 * (excess[:, :-1] + excess[:, :-1].T)
    scale = np.sqrt(np.clip(np.diag(information), 0.0, None))
    if not np.all(scale > 0.0):
        return information, moment
    sizes = np.outer(scale, scale)
    try:
        largest = float(eigh(added / sizes, information / sizes, eigvals_only=True)[-1])
    except np.linalg.LinAlgError:  # not to be told apart from one another: nothing to correct
        return information, moment
    share = min(1.0, (1.0 - _LEAST_LEFT) / largest) if largest > 0.0 else 0.0
    return information - share * added, moment - share * excess[:, -1]


def inflated_covariance(covariance: Array, inverse: Array, theta: Array, noisy: Sequence[ErrorsInVariables]) -> Array:
    """The covariance (p, p) with what the noise's unevenness adds; no variance becomes less."""
    extra = inverse @ np.sum([flight.unevenness(theta) for flight in noisy], axis=0) @ inverse
    variance = np.diag(covariance)
    ratio = np.divide(np.diag(extra), variance, out=np.zeros_like(variance), where=variance > 0.0)
    growth = np.sqrt(1.0 + np.clip(ratio, 0.0, None))
    return np.asarray(covariance * np.outer(growth, growth))
