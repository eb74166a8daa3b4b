"""Imperfections estimated along with the derivatives, and what they do to these.

With the imperfections kappa the residual of coefficient c is r_c + Z_c kappa, Z_c = d(y_c - X_c theta_c) / d kappa: an
imperfection is a further regressor, shared by all equations, with a prior N(0, tolerance^2). In Z_c the model's
prediction stands for the coefficients, which hold the residuals' noise. The joint estimate follows by the partitioned
inverse (mixed estimation of Theil & Goldberger, JASA 56, 1961; consider parameters of Schmidt, 1966, that the data may
tell of: Bierman, "Factorization Methods for Discrete Sequential Estimation", 1977, ch. VIII):

    J_c   = (V'X)^-1 V'Z_c                                  what kappa moves theta_c by, per unit
    D_c   = Z_c - X_c J_c
    A     = diag(tolerance)^-2 + sum_c w_c D_c'P D_c
    kappa = - A^-1 sum_c w_c D_c'P r_c,  cov kappa = A^-1
    theta = theta(0) + J kappa,          cov theta = cov theta(0) + J A^-1 J'

V are the instruments of X. P projects on all that is exogenous: the controls, the instruments, and the rates of both
(two-stage least squares), so that neither sensor noise nor gusts are taken for an imperfection. What the projection
keeps of them nevertheless is taken out of both sums (``many_instruments``). Where X are their own instruments, they
count as exogenous. w_c is one over the noise's energy per unit of the Gram matrix. All of it follows from the Gram
matrix of the signals and their rates (``cross_spectra.moments``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from sysid_node.online.regression.least_squares import RIDGE, TINY, Solution, misfits
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.systematic.column_changes import ColumnChanges
from sysid_node.online.systematic.many_instruments import Scores

Array = NDArray[np.float64]

#: Share of its energy by which an exogenous signal is set apart from the others.
PROJECTION_RIDGE = 1e-8


@dataclass(frozen=True)
class Considered:
    """K imperfections after the flight, and what they do to C coefficients' P slopes and, behind them, offsets."""

    estimate: Array  # (K,)
    covariance: Array  # (K, K)
    jacobian: Array  # (K, C, P + 1)

    @property
    def correction(self) -> Array:
        """(C, P + 1) to be added to the estimates."""
        return np.asarray(np.tensordot(self.estimate, self.jacobian, axes=1))

    def slope_covariance(self) -> Array:
        """(C, P, P) systematic covariance of the slopes."""
        slopes = self.jacobian[:, :, :-1].transpose(1, 2, 0)
        return np.asarray(slopes @ self.covariance @ slopes.swapaxes(1, 2))

    def variance(self) -> Array:
        """(C, P + 1) systematic variances."""
        K, C, places = self.jacobian.shape
        flat = self.jacobian.reshape(K, C * places)
        return np.asarray(((self.covariance @ flat) * flat).sum(axis=0).reshape(C, places))


def consider(
    equations: NormalEquations,
    solution: Solution,
    noise: Array,
    gram: Array,
    changes: ColumnChanges,
    sigmas: Array,
    centre: Array,
    means: Array,
    freedom: Array,
) -> Considered:
    """From the ``gram`` (2N, 2N) of all signals and their rates, ``noise`` (C,) per unit of the Gram matrix.

    ``sigmas`` (K,) are the tolerances of what ``changes`` describes, ``centre`` (K,) its expected values before the
    flight, ``means`` (W,) the signals' means, and ``freedom`` (C,) the noise's degrees of freedom.
    """
    columns, place = changes.columns, np.array([changes.columns.place(i) for i in range(equations.width)])
    N, v = columns.width, np.zeros((columns.width, len(equations.coefficients)))
    v[place] = misfits(equations, solution.theta)
    X, V = place[equations.columns], place[equations.instruments]
    Z = np.tensordot(v.T, changes.signals, axes=(1, 1)) * sigmas[:, None]  # (C, K, 2N), per tolerance
    _predict_outputs(Z, equations, solution, place)
    normal = gram[V[:, None], X] * equations.same_block
    inverse = np.linalg.inv(normal + equations.unit * (RIDGE * np.abs(normal.diagonal()) + TINY))
    J = inverse @ (gram[V] @ Z.swapaxes(1, 2) * equations.belongs.T[:, :, None])  # (C, P, K)
    J *= equations.belongs.T[:, :, None]
    # what the instruments find in the residuals is the noise's part, or rounding
    left = inverse @ ((gram[V, :N] @ v) * equations.belongs) * equations.belongs  # (P, C)
    scores = Scores.none(sigmas.size)
    for block in range(int(equations.block.max()) + 1):
        project = _projection(equations, changes, place, gram, block)
        for c in np.flatnonzero((equations.block == block) & (noise > 0.0)).tolist():
            D, r = Z[c].copy(), np.zeros(2 * N)
            np.add.at(D.T, X, -J[c])
            r[:N] = v[:, c]
            np.add.at(r, X, -left[:, c])
            both = np.column_stack([D.T, r])
            q = project @ both
            further = project.shape[0] - int(equations.belongs[:, c].sum())  # than the unknowns take
            scores.add(q[:, :-1].T @ q, D @ (gram @ both), further / max(float(freedom[c]), 1.0), float(noise[c]))
    estimate, covariance = _posterior(*scores.weighed(), centre / sigmas)
    jacobian = _jacobian(equations, changes, v, J, sigmas, means)
    return Considered(sigmas * estimate, sigmas[:, None] * covariance * sigmas, jacobian / sigmas[:, None, None])


def _predict_outputs(Z: Array, equations: NormalEquations, solution: Solution, place: NDArray[np.intp]) -> None:
    """Put the model's prediction in the place of the coefficients themselves in Z (C, K, 2N), and of their rates.

    A coefficient holds the noise of its own residual. Z would then correlate with the residuals, and an imperfection
    that makes all coefficients smaller would seem to explain noise.
    """
    N = Z.shape[-1] // 2
    for c, output in enumerate(place[equations.outputs].tolist()):
        unknowns = np.flatnonzero(equations.belongs[:, c])
        columns, theta = place[equations.columns[unknowns]], solution.theta[unknowns, c]
        for offset in (0, N):
            Z[..., offset + columns] += Z[..., offset + output, None] * theta
            Z[..., offset + output] = 0.0


def _projection(
    equations: NormalEquations, changes: ColumnChanges, place: NDArray[np.intp], gram: Array, block: int
) -> Array:
    """(E, 2N) whose product with a combination of signals and rates has the norm of its exogenous part."""
    columns, of_block = changes.columns, equations.group == block
    N = columns.width
    chosen = np.zeros(2 * N, dtype=bool)
    exogenous = [*place[changes.layout.deflections], *range(columns.servos.start, columns.instruments.stop)]
    chosen[exogenous] = True
    chosen[N:] = chosen[:N]
    unknowns = of_block & (equations.columns == equations.instruments)
    chosen[place[equations.columns[unknowns]]] = True
    at = np.flatnonzero(chosen & (gram.diagonal() > TINY))
    scale = 1.0 / np.sqrt(gram.diagonal()[at])
    within = gram[np.ix_(at, at)] * scale[:, None] * scale + PROJECTION_RIDGE * np.eye(at.size)
    factor = np.linalg.cholesky(within)
    return np.asarray(solve_triangular(factor, scale[:, None] * gram[at], lower=True))


def _posterior(information: Array, score: Array, centre: Array) -> tuple[Array, Array]:
    """Estimates and their covariance, in tolerances: the prior's precision is one."""
    values, vectors = np.linalg.eigh(information)
    covariance = (vectors / (1.0 + np.maximum(values, 0.0))) @ vectors.T
    return covariance @ (centre - score), covariance


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
