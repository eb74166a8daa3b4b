"""Imperfections by many instruments, without the bias of two-stage least squares.

Two-stage least squares projects a residual r and its sensitivities D to the imperfections on the E exogenous signals.
The projection P keeps, by chance, a part of the noise of both, and where gusts move the aircraft that noise is
correlated: the gust's moment is in r, the motion that it causes in D. The score D'Pr therefore has a mean of

    E[D'Pr] = alpha E[D'r],        alpha = (E - p) / nu,

with the p signals that the unknowns take of the E, and nu degrees of freedom of the noise. It does not vanish with
more data. In turbulence it makes servos seem faster than they are. Where an autopilot answers gusts with the surfaces,
P keeps more than that, and air data seem early: air that turns acts on the moments in proportion to the flow angles'
rates. So in gusts alpha is the share r'Pr / r'r that P keeps of the residual itself, where that is more than chance
explains (limited information maximum likelihood: Anderson & Rubin, Annals of Mathematical Statistics 20, 1949). The
mean is subtracted, as Nagar does (Econometrica 27, 1959; a k-class estimator with k = 1 / (1 - alpha)):

    s = D'(P - alpha I) r / (1 - alpha) / w,      Q = D'(P - alpha I) D / (1 - alpha) / w,      N = D'PD / w

Q is what the flight tells of the imperfections; N, which still holds noise, is the score's variance (many-instrument
standard errors: Bekker, Econometrica 62, 1994). With s = -Q kappa + e, var e = N, generalised least squares has the
information Q N^-1 Q and the score Q N^-1 s. Without noise in D all three matrices are the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Standard deviations by which a residual's share must be larger than by chance to count (positive-part shrinkage).
UNLIKELY = 2.0
LARGEST_SHARE = 0.9  # of the noise that the exogenous signals take up, from which on an equation tells nothing
#: Variance of a score from which on a combination of imperfections counts. Under one the flight would tell less of it
#: than its tolerance does, and what it seems to tell is mostly the noise that was not taken out.
TELLING = 1.0


@dataclass(frozen=True)
class EquationSums:
    """Of one equation with K imperfections: products of its sensitivities and, behind them, its residual [D, r]."""

    projected: Array  # (K + 1, K + 1) [D, r]'P[D, r]
    whole: Array  # (K + 1, K + 1) [D, r]'[D, r]
    further: int  # number of exogenous signals beyond those that the unknowns take
    freedom: float  # degrees of freedom of the noise
    gusts: float  # share of the residual that is not the sensors' noise
    noise: float  # its energy per unit of Gram matrix

    @property
    def by_chance(self) -> float:
        """Share of the noise that the exogenous signals take up by chance."""
        return self.further / max(self.freedom, 1.0)

    def share_taken_up(self, step: Array) -> float:
        """Share of the noise that the exogenous signals take up, as the residual after a ``step`` (K,) shows it.

        The less of the residual's share is beyond what chance explains, the less of it counts. It counts by the share
        of gusts in the residual, because the surfaces do not answer the sensors' noise.
        """
        after = np.append(step, 1.0)
        explained, energy = float(after @ self.projected @ after), float(after @ self.whole @ after)
        chance = UNLIKELY * self.by_chance * math.sqrt(2.0 / max(self.further, 1))
        excess = explained / energy - self.by_chance if energy > 0.0 else 0.0
        if excess <= chance:
            return self.by_chance
        return self.by_chance + self.gusts * excess * (1.0 - (chance / excess) ** 2)


@dataclass
class Scores:
    """Sums over the equations, for K imperfections in units of their tolerances."""

    variance: Array  # N (K, K) of the score
    slope: Array  # Q (K, K) by which the score falls with the imperfections
    score: Array  # s (K,)

    @classmethod
    def none(cls, count: int) -> Scores:
        """Those of no equation, for ``count`` imperfections."""
        return cls(np.zeros((count, count)), np.zeros((count, count)), np.zeros(count))

    def add(self, of_one: EquationSums, share: float) -> None:
        """Add an equation of which a ``share`` of the noise is taken up."""
        if share >= LARGEST_SHARE:
            return
        projected = of_one.projected[:-1]
        free = (projected - share * of_one.whole[:-1]) / ((1.0 - share) * of_one.noise)
        self.variance += projected[:, :-1] / of_one.noise
        self.slope += free[:, :-1]
        self.score += free[:, -1]

    def weighed(self) -> tuple[Array, Array]:
        """The information (K, K) and the score (K,) of generalised least squares."""
        values, vectors = np.linalg.eigh(self.variance)
        seen = values > TELLING
        root = np.sqrt(values[seen])
        white = vectors[:, seen] / root  # makes the score's variance the unit matrix
        slopes, turned = np.linalg.eigh(white.T @ self.slope @ white)
        # a slope below zero is chance: what is there is noise alone
        slopes = np.maximum(slopes, 0.0)
        axes = (vectors[:, seen] * root) @ turned
        return (axes * slopes**2) @ axes.T, axes @ (slopes * (turned.T @ (white.T @ self.score)))
