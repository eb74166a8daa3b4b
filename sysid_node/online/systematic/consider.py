"""Imperfections estimated along with the derivatives, and what they do to these.

With the imperfections kappa the residual of coefficient c is r_c + Z_c kappa, Z_c = d(y_c - X_c theta_c) / d kappa: an
imperfection is a further regressor, shared by all equations, with a prior N(0, tolerance^2). In Z_c the model's
prediction stands for the coefficients, which hold the residuals' noise. The joint estimate follows by the partitioned
inverse (mixed estimation of Theil & Goldberger, JASA 56, 1961; consider parameters of Schmidt, 1966, that the data may
tell of: Bierman, "Factorization Methods for Discrete Sequential Estimation", 1977, ch. VIII):

    J_c   = (V'X)^-1 V'Z_c                                  what kappa moves theta_c by, per unit
    D_c   = Z_c - X_c J_c
    A     = cov(kappa)^-1 before the flight + sum_c w_c D_c'P D_c
    kappa = - A^-1 sum_c w_c D_c'P r_c,  cov kappa = A^-1
    theta = theta(0) + J kappa,          cov theta = cov theta(0) + J A^-1 J'

V are the instruments of X. P projects on all that is exogenous: the controls, the instruments, and the rates of both
(two-stage least squares), so that neither sensor noise nor gusts are taken for an imperfection. What the projection
keeps of them nevertheless is taken out of both sums (``many_instruments``). If the exogenous signals explain more of a
residual than they would of noise (the J of Hansen, Econometrica 50, 1982), something moves with the controls that is
not in the model. The noise then counts as so much larger (Birge, Phys. Rev. 40, 1932), here and in the statistical
errors. Where instruments are weak, X are their own. The expected part of their noise is then subtracted from the
normal equations (``regressor_noise``), as it was for theta(0): otherwise a servo would seem faster, because the vane's
noise makes an aircraft seem less stable. Without any instruments X count as exogenous. w_c is one over
the noise's energy per unit of the Gram matrix. All of it follows from the Gram matrix of the signals and their rates
(``corrected_signals``).

The signals are those that are corrected for the estimates so far, and kappa is estimated again with every look: this is
the Gauss-Newton method. In Z_c, angular accelerations are those of the model's moments: as measured, they hold the
moments' residuals, and a smaller moment of inertia would seem to explain noise.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from sysid_node.online.regression.least_squares import RIDGE, TINY, Solution, residual_combinations
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.systematic.column_changes import ColumnChanges
from sysid_node.online.systematic.corrected_signals import CorrectedSignals
from sysid_node.online.systematic.many_instruments import EquationSums, Scores

Array = NDArray[np.float64]

#: Root mean square of a coefficient below which it is rounding, and tells nothing: that of real instruments' noise is
#: above 1e-4.
STILL = 1e-8
#: Share of its energy by which an exogenous signal is set apart from the others.
PROJECTION_RIDGE = 1e-8


@dataclass(frozen=True)
class Fit:
    """How well C equations with the corrected signals fit."""

    explained: Array  # (C,) energy of the residuals that the exogenous signals explain
    noise: Array  # (C,) that energy per exogenous signal if the residuals were noise; overdispersion included
    improbable: float  # sum of the imperfections' squares about their expectations, in tolerances

    def cost(self, weights: Fit) -> float:
        """What the estimates minimise, with the noise as in ``weights``."""
        counted = weights.noise > 0.0
        return float((self.explained[counted] / weights.noise[counted]).sum()) + self.improbable


@dataclass(frozen=True)
class Considered:
    """K imperfections after the flight, and what they do to C coefficients' P slopes and, behind them, offsets."""

    estimate: Array  # (K,)
    step: Array  # (K,) by which it is beyond what the signals were corrected for
    covariance: Array  # (K, K)
    jacobian: Array  # (K, C, P + 1)
    #: (C,) how many times as much of the residuals as of noise the exogenous signals explain, at least 1
    overdispersion: Array
    fit: Fit  # before the ``step``

    def shortened(self, share: float) -> Considered:
        """With a ``share`` of the step. The rest is uncertain: the signals are not linear enough for it."""
        rest = (1.0 - share) * self.step
        return replace(
            self,
            estimate=self.estimate - rest,
            step=share * self.step,
            covariance=self.covariance + np.outer(rest, rest),
        )

    def with_error(self, places: slice, sigma: float) -> Considered:
        """With an error of 1 ``sigma`` in each of some, independent of all others, that no flight tells."""
        covariance = self.covariance.copy()
        covariance[places, places] += sigma**2 * np.eye(len(covariance))[places, places]
        return replace(self, covariance=covariance)

    def widened(self, other: Array, probability: float) -> Considered:
        """With the variance about this estimate of a mixture in which an ``other`` (K,) has a ``probability``."""
        off = other - self.estimate
        return replace(self, covariance=self.covariance + probability * np.outer(off, off))

    @property
    def correction(self) -> Array:
        """(C, P + 1) what the ``step`` adds to the estimates."""
        return np.asarray(np.tensordot(self.step, self.jacobian, axes=1))

    def slope_covariance(self) -> Array:
        """(C, P, P) systematic covariance of the slopes."""
        slopes = self.jacobian[:, :, :-1].transpose(1, 2, 0)
        return np.asarray(slopes @ self.covariance @ slopes.swapaxes(1, 2))

    def variance(self) -> Array:
        """(C, P + 1) systematic variances."""
        K, C, places = self.jacobian.shape
        flat = self.jacobian.reshape(K, C * places)
        return np.asarray(((self.covariance @ flat) * flat).sum(axis=0).reshape(C, places))


@dataclass(frozen=True)
class Beliefs:
    """What is believed of K imperfections before the flight."""

    sigmas: Array  # (K,) tolerances
    centre: Array  # (K,) expected values
    precision: Array  # (K, K) inverse of their correlations


class _Sensitivities(NamedTuple):
    """What one tolerance of each imperfection changes; N signals, and their rates."""

    v: Array  # (N, C) combinations of signals that are the residuals
    J: Array  # (C, P, K) what it moves the slopes by
    residuals: Array  # (C, K + 1, 2N) what it changes of the residuals beyond that, and the residuals themselves


class _Findings(NamedTuple):
    """What the exogenous signals find of the imperfections in the residuals of C equations."""

    imperfections: int  # K
    equations: list[EquationSums]
    overdispersion: Array  # (C,) see ``Considered``
    explained: Array  # (C,) see ``Fit``
    moves: NDArray[np.bool_]  # (C,) coefficients that are more than rounding

    def scores(self, shares: Sequence[float]) -> Scores:
        """The sums over all equations, of each of which a share of the noise is taken up."""
        found = Scores.none(self.imperfections)
        for of_one, share in zip(self.equations, shares, strict=True):
            found.add(of_one, share)
        return found


def consider(
    equations: NormalEquations,
    solution: Solution,
    noise: Array,
    signals: CorrectedSignals,
    place: NDArray[np.intp],
    beliefs: Beliefs,
    freedom: Array,
    gusts: Array,
    noise_gram: Array | None = None,
) -> Generator[None, None, Considered]:
    """From the corrected ``signals`` and their ``solution``; ``noise`` (C,) is per unit of the Gram matrix.

    ``place`` (W,): where the columns of the regression stand among the signals. ``freedom`` (C,) are the noise's
    degrees of freedom, ``gusts`` (C,) the share of the residuals that is not the sensors' noise. ``noise_gram`` (W, W):
    the Gram matrix of the regressors' noise that the ``solution`` was freed of. It is made in three steps
    (``state.Steps``).
    """
    sigmas = beliefs.sigmas
    of_each = _sensitivities(equations, solution, signals, place, sigmas, noise_gram)
    yield
    found = _findings(equations, of_each.residuals, noise, signals, place, freedom, gusts, freed=noise_gram is not None)
    off = (beliefs.centre - signals.estimate) / sigmas
    by_chance = found.scores([of_one.by_chance for of_one in found.equations])
    step, _ = _posterior(*by_chance.weighed(), off, beliefs.precision)
    yield
    measured = found.scores([of_one.share_taken_up(step) for of_one in found.equations])
    step, covariance = _posterior(*measured.weighed(), off, beliefs.precision)
    jacobian = _jacobian(equations, signals.changes, of_each.v, of_each.J, sigmas, signals.corrected_means)
    return Considered(
        signals.estimate + sigmas * step,
        sigmas * step,
        sigmas[:, None] * covariance * sigmas,
        jacobian / sigmas[:, None, None],
        found.overdispersion,
        Fit(found.explained, noise * found.overdispersion * found.moves, float(off @ beliefs.precision @ off)),
    )


def _sensitivities(
    equations: NormalEquations,
    solution: Solution,
    signals: CorrectedSignals,
    place: NDArray[np.intp],
    sigmas: Array,
    noise_gram: Array | None,
) -> _Sensitivities:
    """What the imperfections change of the slopes and the residuals, per tolerance."""
    structure, gram, changes = equations.structure, signals.gram, signals.changes
    v = np.zeros((changes.columns.width, len(structure.coefficients)))
    v[place] = residual_combinations(equations, solution.theta)
    X, V = signals.matrix[place[equations.columns]], signals.matrix[place[equations.instruments]]
    residuals = v.T @ signals.matrix  # (C, 2N)
    # (C, K, 2N), per tolerance; one product for each imperfection, as the changes need not be copied for it
    Z = np.ascontiguousarray((v.T @ changes.signals).swapaxes(0, 1)) * sigmas[:, None]
    Z = Z @ _by_the_model(equations, solution, place, signals)
    across = V @ gram
    if noise_gram is not None and not equations.instrumented.all():
        expected = np.zeros_like(gram)
        expected[np.ix_(place, place)] = noise_gram
        across -= V @ expected
    normal = (across @ X.T) * structure.same_block
    inverse = np.linalg.inv(normal + structure.unit * (RIDGE * np.abs(normal.diagonal()) + TINY))
    J = inverse @ (across @ Z.swapaxes(1, 2) * structure.belongs.T[:, :, None])  # (C, P, K)
    J *= structure.belongs.T[:, :, None]
    # what the instruments find in the residuals is the noise's part, or rounding
    left = inverse @ ((across @ residuals.T) * structure.belongs) * structure.belongs  # (P, C)
    both = np.concatenate([Z - J.swapaxes(1, 2) @ X, (residuals - left.T @ X)[:, None]], axis=1)
    return _Sensitivities(v, J, both)


def _findings(
    equations: NormalEquations,
    residuals: Array,
    noise: Array,
    signals: CorrectedSignals,
    place: NDArray[np.intp],
    freedom: Array,
    gusts: Array,
    *,
    freed: bool,
) -> _Findings:
    """What the exogenous signals find in the ``residuals`` (C, K + 1, 2N) and their changes.

    Regressors that are their own instruments are exogenous where the solution was not ``freed`` of their noise.
    """
    structure, gram = equations.structure, signals.gram
    C = len(structure.coefficients)
    equations_found, overdispersion, explained = list[EquationSums](), np.ones(C), np.zeros(C)
    moves = gram.diagonal()[place[equations.outputs]] > STILL**2 * signals.information.energy
    for block in range(int(structure.block.max()) + 1):
        project = _projection(equations, signals.changes, place, gram, block, freed=freed)
        for c in np.flatnonzero((structure.block == block) & (noise > 0.0) & moves).tolist():
            q = project @ residuals[c].T
            projected, whole = q.T @ q, residuals[c] @ gram @ residuals[c].T
            further = project.shape[0] - int(structure.belongs[:, c].sum())  # than the unknowns take
            explained[c] = projected[-1, -1]
            overdispersion[c] = max(float(explained[c]) / (float(noise[c]) * max(further, 1)), 1.0)
            weight = float(noise[c] * overdispersion[c])
            equations_found.append(EquationSums(projected, whole, further, float(freedom[c]), float(gusts[c]), weight))
    return _Findings(residuals.shape[1] - 1, equations_found, overdispersion, explained, moves)


def _by_the_model(
    equations: NormalEquations, solution: Solution, place: NDArray[np.intp], signals: CorrectedSignals
) -> Array:
    """(2N, 2N) what each signal and rate is by the model: products with it hold no residual."""
    found = np.eye(signals.gram.shape[0])
    _accelerations_by_moments(found, signals.changes)
    _predict_outputs(found, equations, solution, place, signals)
    return found


def _accelerations_by_moments(Z: Array, changes: ColumnChanges) -> None:
    """Put moments in the place of the angular accelerations in Z (..., 2N), which hold the moments' residuals."""
    rates, moments, per_moment = changes.angular_accelerations()
    accelerations = changes.rates[rates]
    Z[..., moments] += Z[..., accelerations] @ per_moment
    Z[..., accelerations] = 0.0


def _predict_outputs(
    Z: Array, equations: NormalEquations, solution: Solution, place: NDArray[np.intp], signals: CorrectedSignals
) -> None:
    """Put the model's prediction in the place of the coefficients themselves in Z (..., 2N), and of their rates.

    A coefficient holds the noise of its own residual. Z would then correlate with the residuals, and an imperfection
    that makes all coefficients smaller would seem to explain noise. The model predicts the corrected coefficient by the
    corrected regressors; the recorded one is less by what it was corrected by.
    """
    rates, matrix = signals.changes.rates, signals.matrix
    for c, output in enumerate(place[equations.outputs].tolist()):
        unknowns = np.flatnonzero(equations.structure.belongs[:, c])
        columns, theta = place[equations.columns[unknowns]], solution.theta[unknowns, c]
        share = Z[..., output].copy()
        Z[..., output] = 0.0
        predicted = theta @ matrix[columns] - matrix[output]
        predicted[output] += 1.0
        Z += share[..., None] * predicted
        Z[..., rates[columns]] += Z[..., rates[output], None] * theta
        Z[..., rates[output]] = 0.0


def _projection(
    equations: NormalEquations,
    changes: ColumnChanges,
    place: NDArray[np.intp],
    gram: Array,
    block: int,
    *,
    freed: bool,
) -> Array:
    """(E, 2N) whose product with a combination of signals and rates has the norm of its exogenous part."""
    columns, of_block = changes.columns, equations.structure.group == block
    N = columns.width
    chosen = np.zeros(2 * N, dtype=bool)
    first, made = columns.servos.start, columns.instruments
    exogenous = [*place[changes.layout.deflections], *range(first, first + len(changes.layout.timed))]
    if freed or not equations.least_squares:  # else the regressors, which hold more, stand in their place
        exogenous += range(made.start, made.stop)
    chosen[exogenous] = True
    chosen[N:] = chosen[:N]
    unknowns = of_block & (equations.columns == equations.instruments) & (not freed)
    chosen[place[equations.columns[unknowns]]] = True
    at = np.flatnonzero(chosen & (gram.diagonal() > TINY))
    scale = 1.0 / np.sqrt(gram.diagonal()[at])
    within = gram[np.ix_(at, at)] * scale[:, None] * scale + PROJECTION_RIDGE * np.eye(at.size)
    factor = np.linalg.cholesky(within)
    return np.asarray(solve_triangular(factor, scale[:, None] * gram[at], lower=True))


def _posterior(information: Array, score: Array, centre: Array, precision: Array) -> tuple[Array, Array]:
    """Estimates and their covariance, in tolerances, of which the ``precision`` before the flight is."""
    covariance = np.linalg.inv(information + precision)
    covariance = 0.5 * (covariance + covariance.T)
    return covariance @ (precision @ centre - score), covariance


def _jacobian(
    equations: NormalEquations, changes: ColumnChanges, v: Array, J: Array, sigmas: Array, means: Array
) -> Array:
    """(K, C, P + 1) of slopes and, behind them, offsets: C_0 = mean of y - sum theta_j mean of x_j."""
    C, P, K = J.shape
    found = np.empty((K, C, P + 1))
    found[:, :, :P] = J.transpose(2, 0, 1)
    direct = (changes.shifts @ v) * sigmas[:, None]
    found[:, :, P] = direct - found[:, :, :P] @ means[equations.columns]
    return found
