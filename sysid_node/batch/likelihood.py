"""What output error and filter error share: maximum likelihood by alternating between noise and parameters.

The likelihood of N(0, R) residuals with unknown R is largest where det R of the sample covariance is smallest
(Maine & Iliff, 1986, sec. 5.2). Relaxation gets there by least squares weighted with the present R, then a new R, until
neither moves (Jategaonkar, 2015, sec. 4.6).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from sysid_node.batch.result import Answer
from sysid_node.batch.unknowns import Unknowns
from sysid_node.errors import InputError
from sysid_node.flight.record import Array

#: Converged once a whole round moves no unknown by more than this share of its standard error.
TOLERANCE = 1e-3


@dataclass(frozen=True)
class Search:
    """How long to look: rounds of noise relaxation, and model evaluations within each."""

    rounds: int = 60
    evaluations: int = 50


DEFAULT_SEARCH = Search()


class Problem(ABC):
    """An estimation as functions of z (n,): the unknowns first, then what a method adds."""

    def __init__(self, unknowns: Unknowns) -> None:
        self.unknowns = unknowns
        self._prior_index, self._prior_mean, self._prior_sigma = unknowns.priors()

    @abstractmethod
    def start(self) -> Array:
        """Start values (n,)."""

    @abstractmethod
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds (n,)."""

    @abstractmethod
    def answers(self, z: Array) -> list[Answer]:
        """What the model makes of each manoeuvre."""

    @abstractmethod
    def sensitivities(self, z: Array) -> list[Array]:
        """d modelled / d z (N, ny, n) of each manoeuvre, zero where nothing was measured."""

    @abstractmethod
    def noise(self, z: Array) -> Array:
        """Lower Cholesky factor (ny, ny) of the residuals' covariance at ``z``."""

    def whitened(self, z: Array, factor: Array) -> tuple[list[Array], list[Array]]:
        """Residuals (N, ny) and sensitivities (N, ny, n) of each manoeuvre in units of the noise."""
        residuals = [whiten(factor, np.nan_to_num(a.residuals, nan=0.0)) for a in self.answers(z)]
        return residuals, [whiten(factor, block) for block in self.sensitivities(z)]

    def residuals(self, z: Array, factor: Array) -> Array:
        """Measured minus modelled in units of the noise, zero where nothing was measured, then the priors."""
        parts = [whiten(factor, np.nan_to_num(a.residuals, nan=0.0)).ravel() for a in self.answers(z)]
        return np.concatenate([*parts, (self._prior_mean - z[self._prior_index]) / self._prior_sigma])

    def jacobian(self, z: Array, factor: Array) -> Array:
        """d residuals / d z."""
        parts = [-whiten(factor, block).reshape(-1, z.size) for block in self.sensitivities(z)]
        prior = np.zeros((self._prior_index.size, z.size))
        prior[np.arange(self._prior_index.size), self._prior_index] = -1.0 / self._prior_sigma
        return np.concatenate([*parts, prior])

    def check(self, z: Array) -> None:
        """Raises InputError with too few measurements, or where the model does not stay finite at ``z``."""
        available = sum(int(np.isfinite(m.outputs).sum()) for m in self.unknowns.manoeuvres)
        if available < 2 * z.size:
            raise InputError(
                f"{available} measured values for {z.size} unknowns; give longer manoeuvres or estimate less "
                "(fewer parameters, initial states and biases)"
            )
        for answer in self.answers(z):
            lost = np.argwhere(~np.isfinite(answer.modelled))
            if lost.size:
                row, column = lost[0]
                raise InputError(
                    f"{answer.name}: model {self.unknowns.model.name} diverges from its start values: "
                    f"{answer.names[column]} is not finite from {answer.time[row]:.2f} s on; start nearer to the "
                    "aircraft (equation_error finds start values) or cut the flight into shorter manoeuvres"
                )


def diagonal_noise(answers: Sequence[Answer]) -> Array:
    """Factor (ny, ny) of independent noises; no output's is taken to be below a rounding error of its size."""
    residuals = np.concatenate([answer.residuals for answer in answers])
    size = np.nanmax(np.abs(np.concatenate([answer.measured for answer in answers])), axis=0, initial=0.0)
    return np.diag(np.maximum(np.sqrt(np.nanmean(residuals**2, axis=0)), 1e-12 * (1.0 + size)))


def whiten(factor: Array, rows: Array) -> Array:
    """``rows`` (N, ny, ...) in units of the noise: factor^-1 applied to the second axis."""
    if not np.any(np.tril(factor, -1)):
        return np.asarray(rows / np.diag(factor).reshape(1, -1, *(1,) * (rows.ndim - 2)))
    channels_first = np.moveaxis(rows, 1, 0)
    white = solve_triangular(factor, channels_first.reshape(len(factor), -1), lower=True)
    return np.moveaxis(white.reshape(channels_first.shape), 0, 1)


def maximise(problem: Problem, search: Search) -> tuple[Array, int, str]:
    """The unknowns of maximum likelihood, the rounds it took, and a complaint where it did not converge."""
    z = problem.start()
    problem.check(z)
    moved = np.inf
    for iteration in range(1, search.rounds + 1):
        previous, factor = z, problem.noise(z)
        z = weighted_least_squares(problem, z, np.arange(z.size), factor, search.evaluations)
        # |J dz| bounds every |dz_i| over its standard error
        moved = float(np.linalg.norm(problem.jacobian(z, factor) @ (z - previous)))
        if moved < TOLERANCE:
            return z, iteration, ""
    return (
        z,
        search.rounds,
        f"not converged after {search.rounds} rounds of noise relaxation: the last moved the estimates by up to "
        f"{moved:.2g} standard errors",
    )


def weighted_least_squares(
    problem: Problem, z: Array, chosen: NDArray[np.intp], factor: Array, evaluations: int
) -> Array:
    """The unknowns with those of index ``chosen`` moved to the least squares for this noise."""

    def moved(x: Array) -> Array:
        full = z.copy()
        full[chosen] = x
        return full

    def residuals(x: Array) -> Array:
        return problem.residuals(moved(x), factor)

    def jacobian(x: Array) -> Array:
        return problem.jacobian(moved(x), factor)[:, chosen]

    lower, upper = problem.bounds()
    # a start value on its bound would leave the interior method no step
    inside = np.clip(z[chosen], lower[chosen], upper[chosen])
    solution = least_squares(
        residuals,
        inside,
        jacobian,
        bounds=(lower[chosen], upper[chosen]),
        x_scale="jac",
        max_nfev=evaluations,
    )
    return moved(solution.x)
