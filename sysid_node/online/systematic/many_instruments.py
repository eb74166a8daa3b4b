"""Imperfections by many instruments, without the bias of two-stage least squares.

Two-stage least squares projects a residual r and its sensitivities D to the imperfections on the E exogenous signals.
The projection P keeps, by chance, a part of the noise of both, and where gusts move the aircraft that noise is
correlated: the gust's moment is in r, the motion that it causes in D. The score D'Pr therefore has a mean of

    E[D'Pr] = alpha E[D'r],        alpha = (E - p) / nu,

with the p signals that the unknowns take of the E, and nu degrees of freedom of the noise. It does not vanish with
more data. In turbulence it makes servos seem faster than they are. Where the deflections answer gusts, P keeps more
than that: E times the mean square of the correlation between one signal and gusts, which is a share of the largest that
is allowed for (``gust_correlation``), is the ratio of what is kept to what is not (``share_taken_up``). Without it, air
data seem early where gusts turn the air: such air acts on the moments in proportion to the flow angles' rates. The mean
is subtracted, as Nagar does (Econometrica 27, 1959; a k-class estimator with k = 1 / (1 - alpha)):

    s = D'(P - alpha I) r / (1 - alpha) / w,      Q = D'(P - alpha I) D / (1 - alpha) / w,      N = D'PD / w

Q is what the flight tells of the imperfections; N, which still holds noise, is the score's variance (many-instrument
standard errors: Bekker, Econometrica 62, 1994). With s = -Q kappa + e, var e = N, generalised least squares has the
information Q N^-1 Q and the score Q N^-1 s. Without noise in D all three matrices are the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Mean square of the correlation between an exogenous signal and gusts, over the square of what is allowed for.
KEPT = 0.2
LARGEST_SHARE = 0.9  # of the noise that the exogenous signals take up, from which on an equation tells nothing
#: Variance of a score from which on a combination of imperfections counts. Under one the flight would tell less of it
#: than its tolerance does, and what it seems to tell is mostly the noise that was not taken out.
TELLING = 1.0


def share_taken_up(signals: int, further: int, freedom: float, answered: float) -> float:
    """Share of the noise that so many exogenous ``signals`` take up, ``further`` ones than the unknowns take.

    ``freedom``: the noise's degrees of freedom; ``answered``: the correlation between instruments and gusts that is
    allowed for.
    """
    by_gusts = KEPT * signals * answered**2  # explained by the signals over not explained
    kept = by_gusts / (1.0 + by_gusts)
    return kept + (1.0 - kept) * further / max(freedom, 1.0)


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

    def add(self, projected: Array, whole: Array, share: float, noise: float) -> None:
        """Add an equation of which ``share`` of the noise is taken up; ``noise`` is its energy per unit of Gram matrix.

        ``projected`` (K, K + 1): D'P[D, r]; ``whole`` (K, K + 1): D'[D, r].
        """
        if share >= LARGEST_SHARE:
            return
        free = (projected - share * whole) / ((1.0 - share) * noise)
        self.variance += projected[:, :-1] / noise
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
