"""How strongly a stretch of flight contradicts the estimates from before it.

With the earlier estimates theta the residual r = y - A theta of the stretch's lines is noise, and while nothing has
changed the score Z'r has zero mean and the covariance S Z'KZ + G C G' (Z: the instruments, or the regressors A
themselves, whichever the estimates were solved with; C: the estimates' covariance; G = Z'A; S K: the noise's). So

    F = (Z'r)' [S Z'KZ + G C G']^-1 (Z'r) / p

is Fisher's F with p and the residual density's degrees of freedom. It needs no strong instruments: where they are weak,
C is large (the test of Anderson & Rubin, Annals of Mathematical Statistics 20, 1949). Instruments from the deflections
hold nothing of the gusts, so gusts are no contradiction. Regressors that are their own instruments hold the sensors'
noise, which the estimates were freed of (``regressor_noise``). The score's mean is then that of the noise, and where
the controls hardly move, it is the largest part of the score. It is taken off, as much of it as brings F down, but no
more than the file's noise makes: how large the noise is at present is not known better. Over stretches shorter than the
period of the line spacing Z'KZ is Z'Z over twice that spacing. S is taken by bands, and no less than what no
derivatives explain of the stretch itself: air that has become rougher is no contradiction either. C counts with the
factor that gusts bring to the variances, which the controls answer. So does Z'KZ, by the correlation of the stretch's
own deflections with gusts (``gust_correlation``): where surfaces are not moved on purpose, they only answer gusts.
Where a servo's time is known to a standard error only, what such an error makes of the score is added to its
covariance. So are the errors of what the lines were corrected for (``corrected_lines``), and a share of the estimates'
systematic errors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv
from scipy.special import fdtrc

from sysid_node.online.regression import gust_correlation
from sysid_node.online.regression.information import Spectrum
from sysid_node.online.regression.instruments import InstrumentModel
from sysid_node.online.regression.least_squares import TINY, Solution, Uncertainty
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.systematic.corrected_lines import LineCorrection

Array = NDArray[np.float64]

#: Share of the correlation between instruments and gusts that is not the same in a stretch and where was learned from:
#: the same loops answered the gusts in both, so that much of the bias is common to both.
UNSHARED = 0.5
LEAST = 0.1  # share of a stretch's energy that at least counts as the noise's, however many unknowns it has
RIDGE = 1e-9  # share by which what did not move is set apart
#: Share of the systematic errors by which manoeuvres may differ: imperfections are corrected to first order, and their
#: products and second derivatives act otherwise in each.
SECOND_ORDER = 0.2
NUISANCES = 3  # lines that offset, constant and drift take up


@dataclass(frozen=True)
class ReferenceEstimates:
    """The estimates as they stood at one time (s), and by which equations."""

    time: float
    equations: NormalEquations
    solution: Solution
    uncertainty: Uncertainty
    model: InstrumentModel | None = None  # by which the lines were made of the transform: servos, instruments
    noise_score: Array | None = None  # (P, C) the score's mean by the sensors' noise, per line and second; None: zero
    time_errors: Array | None = None  # (P,) standard errors of the regressors' times, s; None: all are exact
    inflation: Array | None = None  # (C,) factors of the covariance by gusts that the controls answer; None: one
    sensed: Array | None = None  # (C,) density of the sensors' noise in the residuals; None: no controls answer gusts
    systematic: Array | None = None  # (C, P, P) systematic covariance of the estimates; None: all is exact
    correction: LineCorrection | None = None  # of the lines that the estimates are of; None: they are as recorded
    corrected: ReferenceEstimates | None = None  # the same estimates by corrected lines; None: there are none

    @classmethod
    def stacked(cls, some: Sequence[ReferenceEstimates]) -> ReferenceEstimates:
        """Estimates by the same equations and of lines made alike, with an axis in front."""
        solution = Solution(*_columns([one.solution for one in some]))
        uncertainty = Uncertainty(*_columns([one.uncertainty for one in some]))
        scores = [one.noise_score if one.noise_score is not None else np.zeros_like(one.solution.theta) for one in some]
        exact = np.zeros(some[0].equations.columns.size)
        times = [exact if one.time_errors is None else one.time_errors for one in some]
        none, zero = np.ones(solution.theta.shape[-1]), np.zeros_like(uncertainty.covariance[0])
        no_gusts = np.full_like(none, np.inf)
        return cls(
            some[0].time,
            some[0].equations,
            solution,
            uncertainty,
            some[0].model,
            np.array(scores),
            np.array(times),
            np.array([none if one.inflation is None else one.inflation for one in some]),
            np.array([no_gusts if one.sensed is None else one.sensed for one in some]),
            np.array([zero if one.systematic is None else one.systematic for one in some]),
        )


def _columns(rows: Sequence[Solution] | Sequence[Uncertainty]) -> Iterator[NDArray[Any]]:
    """Each field of the rows, with an axis in front."""
    return (np.array([getattr(row, field.name) for row in rows]) for field in fields(rows[0]))


@dataclass(frozen=True)
class ScoreTest:
    """Of C coefficients over one stretch, or over each of several (...)."""

    statistic: Array  # (..., C) F
    count: Array  # (C,) derivatives, its first degrees of freedom
    freedom: Array  # (..., C) its second
    unexplained: Array  # (..., C) density that no derivatives explain, over the usual one
    share: Array  # (..., C) of the motion's energy that no derivatives explain

    def chance(self, margin: Array | float) -> Array:
        """(..., C) probability of a statistic so large, ``margin`` times over, where nothing has changed."""
        return np.asarray(fdtrc(self.count, np.maximum(self.freedom, 1.0), self.statistic / margin))

    def each(self) -> Iterator[ScoreTest]:
        """Those of the several stretches, one by one."""
        freedom = np.broadcast_to(self.freedom, self.statistic.shape)
        for some in zip(self.statistic, freedom, self.unexplained, self.share, strict=True):
            yield ScoreTest(some[0], self.count, *some[1:])


def score_test(
    reference: ReferenceEstimates, lines: Array, spectrum: Spectrum, duration: Any, errors: Array | None = None
) -> ScoreTest:
    """Test the clean ``lines`` (..., 2F, W) of stretches of ``duration`` (...) s.

    ``errors`` (..., C, 2F, K) are those of the residuals by K independent errors of the lines, one standard deviation
    of each.
    """
    equations, known = reference.equations, reference.uncertainty
    structure = equations.structure
    density_per_gram = math.pi / float(spectrum.omega[1] - spectrum.omega[0])
    gram = lines.swapaxes(-1, -2) @ lines.copy()  # of one array half would be made and mirrored, which is slower
    regressed = gram.take(equations.columns, axis=-1)
    left_over = gram.take(equations.outputs, axis=-1) - regressed @ reference.solution.theta
    count = structure.belongs.sum(axis=0)
    normal = regressed.take(equations.columns, axis=-2)
    rest = _unexplained(equations, reference, normal, left_over)
    energy = 0.5 * lines.shape[-2] * np.asarray(duration)[..., None]
    density = rest / np.maximum(energy - (count + NUISANCES) * density_per_gram, LEAST * energy)
    excess = density / np.maximum(known.density, TINY)
    Z = lines.take(equations.instruments, axis=-1)[..., None, :, :]
    of_each = _band_of_each(tuple(band.stop for band in spectrum.bands))
    noise = (Z.swapaxes(-1, -2) * known.bands.take(of_each, axis=-1)[..., None, :]) @ Z
    more = np.maximum(excess, 1.0)
    if reference.sensed is not None:
        usual = more * known.density
        gusts = gust_correlation.share_of_gusts(usual, reference.sensed)
        answered = gust_correlation.by_deflections(
            equations, reference.solution.theta, normal, gusts * usual * energy, UNSHARED * gust_correlation.ANSWERED
        )
        more = more * (1.0 + answered**2 * gusts * energy / density_per_gram)
    noise *= (density_per_gram * more)[..., None, None]
    G = (regressed.take(equations.instruments, axis=-2) * structure.same_block)[..., None, :, :]
    covariance = known.covariance
    if reference.inflation is not None:
        covariance = reference.inflation[..., None, None] * covariance
    if reference.systematic is not None:
        covariance = covariance + SECOND_ORDER**2 * reference.systematic
    spread = noise + G @ covariance @ G.swapaxes(-1, -2)
    if reference.time_errors is not None and reference.time_errors.any():
        spread += _by_times(reference, Z, lines.take(equations.columns, axis=-1), spectrum.omega)
    if errors is not None:
        off = Z.swapaxes(-1, -2) @ errors  # (..., C, P, K)
        spread += off @ off.swapaxes(-1, -2)
    score = (left_over.take(equations.instruments, axis=-2) * structure.belongs).swapaxes(-1, -2)
    motion = np.maximum(gram.diagonal(axis1=-2, axis2=-1).take(equations.outputs, axis=-1), TINY)
    by_noise = None
    if reference.noise_score is not None:
        amount = np.maximum(energy - NUISANCES * density_per_gram, 0.0)
        by_noise = (amount[..., None] * reference.noise_score).swapaxes(-1, -2)
    statistic = _normalised(equations, spread, score, by_noise) / count
    return ScoreTest(statistic, count, known.freedom, excess, rest / motion)


def _by_times(reference: ReferenceEstimates, instruments: Array, regressors: Array, omega: Array) -> Array:
    """(..., C, P, P) the score's covariance by errors of the regressors' times, which turn their lines (..., 2F, P).

    A regressor that comes dt later is x (1 - i omega dt) to first order.
    """
    assert reference.time_errors is not None
    F = omega.size
    turned = np.concatenate([regressors[..., F:, :], -regressors[..., :F, :]], axis=-2) * np.tile(omega, 2)[:, None]
    weight = reference.solution.theta.swapaxes(-1, -2) * reference.time_errors[..., None, :]  # (..., C, P)
    off: Array = (instruments.swapaxes(-1, -2) @ turned[..., None, :, :]) * weight[..., None, :]
    return off @ off.swapaxes(-1, -2)


def _unexplained(equations: NormalEquations, reference: ReferenceEstimates, normal: Array, left_over: Array) -> Array:
    """(..., C) the least that any change of the derivatives would leave of the residuals' energy.

    ``normal`` (..., P, P): Gram matrix of the regressors.
    """
    structure = equations.structure
    unexplained: Array = left_over.take(equations.outputs, axis=-2).diagonal(axis1=-2, axis2=-1).copy()
    score = left_over.take(equations.columns, axis=-2) * structure.belongs
    normal = normal * structure.same_block
    normal += structure.unit * (RIDGE * normal.diagonal(axis1=-2, axis2=-1) + TINY)[..., None, :]
    solved = np.empty_like(score)
    for one, right, found in zip(_each(normal), _each(score), _each(solved), strict=True):
        found[:] = dposv(one, right)[1]
    unexplained -= (score * (reference.solution.theta + solved)).sum(axis=-2)
    return unexplained


def _each(matrices: Array) -> Array:
    """(N, ., .) of (..., ., .), where they lie."""
    return matrices.reshape(-1, *matrices.shape[-2:])


@cache
def _band_of_each(ends: tuple[int, ...]) -> NDArray[np.intp]:
    """(2F,) the band of each line's real part, then of each line's imaginary part; ``ends`` are the bands'."""
    return np.tile(np.searchsorted(ends, np.arange(ends[-1]), side="right"), 2)


def _normalised(equations: NormalEquations, spread: Array, score: Array, by_noise: Array | None = None) -> Array:
    """(..., C) score' spread^-1 score of scores (..., C, P) over the unknowns that belong.

    Of scores less the share, none to all, of what is ``by_noise`` (..., C, P) at which it is least.
    """
    belongs = equations.structure.belongs.T
    variance = spread.diagonal(axis1=-2, axis2=-1) * belongs
    weight = np.where(variance > 0.0, 1.0 / np.sqrt(np.maximum(variance, TINY**2)), 0.0)
    correlation = spread * weight[..., None] * weight[..., None, :]
    correlation += equations.structure.unit * (RIDGE + (weight == 0.0))[..., None]
    scaled = np.stack([score * weight] if by_noise is None else [score * weight, by_noise * weight], axis=-1)
    product = scaled.swapaxes(-1, -2) @ np.linalg.solve(correlation, scaled)
    least: Array = product[..., 0, 0]
    if by_noise is not None:
        share = np.clip(product[..., 0, 1] / np.maximum(product[..., 1, 1], TINY**2), 0.0, 1.0)
        least = least - share * (2.0 * product[..., 0, 1] - share * product[..., 1, 1])
    return least


def disagreement(one: ReferenceEstimates, other: ReferenceEstimates) -> Array:
    """(C,) the chance that the estimates of two stretches differ as much, were they independent and both unbiased."""
    equations = one.equations
    structure = equations.structure
    difference = ((one.solution.theta - other.solution.theta) * structure.belongs).T
    count = structure.belongs.sum(axis=0)
    spread = one.uncertainty.covariance + other.uncertainty.covariance
    freedom = np.minimum(one.uncertainty.freedom, other.uncertainty.freedom)
    return np.asarray(fdtrc(count, np.maximum(freedom, 1.0), _normalised(equations, spread, difference) / count))
