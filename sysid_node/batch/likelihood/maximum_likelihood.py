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

from sysid_node.batch.likelihood.unknowns import Priors, Unknowns
from sysid_node.batch.regression.coloured_residuals import coloured_covariance, spectral_degrees_of_freedom
from sysid_node.batch.results.response import ModelResponse
from sysid_node.errors import InputError
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class SearchOptions:
    """How long to look: rounds of noise relaxation, and model evaluations within each.

    Converged once a whole round moves no unknown by more than ``tolerance`` of its standard error. ``early``
    evaluations are enough for a round that another will follow; the last has ``evaluations``.
    """

    rounds: int = 60
    evaluations: int = 50
    tolerance: float = 1e-3
    early: int = 50


DEFAULT_SEARCH = SearchOptions()

#: A model whose answer is so many times the measurement has diverged.
_DIVERGED = 1e6

#: Rounds of noise relaxation for initial states and biases alone.
_OWN_ROUNDS = 4


class LikelihoodProblem(ABC):
    """An estimation as functions of z (n,): the unknowns first, then what a method adds."""

    def __init__(self, unknowns: Unknowns) -> None:
        self.unknowns = unknowns

    @abstractmethod
    def start(self) -> Array:
        """Start values (n,)."""

    @abstractmethod
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds (n,)."""

    @abstractmethod
    def responses(self, z: Array) -> list[ModelResponse]:
        """What the model makes of each manoeuvre."""

    @abstractmethod
    def sensitivities(self, z: Array) -> list[Array]:
        """d modelled / d z (N, ny, n) of each manoeuvre, zero where nothing was measured."""

    def priors(self) -> Priors:
        """What is known beforehand: indices into z, means, 1-sigma uncertainties."""
        return self.unknowns.priors()

    def noise(self, z: Array) -> Array:
        """Lower Cholesky factor (ny, ny) of the residuals' covariance: here independent outputs.

        No output's noise is taken to be below a rounding error of its size.
        """
        responses = self.responses(z)
        residuals = np.concatenate([response.residuals for response in responses])
        size = np.nanmax(np.abs(np.concatenate([response.measured for response in responses])), axis=0, initial=0.0)
        return np.diag(np.maximum(np.sqrt(np.nanmean(residuals**2, axis=0)), 1e-12 * (1.0 + size)))

    def weighted(self, z: Array, noise: Array) -> tuple[list[Array], list[Array]]:
        """Residuals (N, ny), zero where nothing was measured, and sensitivities (N, ny, n), in units of the noise."""
        residuals = [in_noise_units(_measured_only(response), noise) for response in self.responses(z)]
        return residuals, [in_noise_units(block, noise) for block in self.sensitivities(z)]

    def covariance(
        self, information: Array, sensitivities: Sequence[Array], residuals: Sequence[Array]
    ) -> tuple[Array, float]:
        """Covariance (n, n) of the estimates, and its degrees of freedom, from what ``weighted`` gives: here with
        sensitivities that owe nothing to the noise, whatever its colour.
        """
        freedom = spectral_degrees_of_freedom([len(errors) for errors in residuals])
        return coloured_covariance(inverted(information), sensitivities, residuals), freedom

    def residuals(self, z: Array, noise: Array) -> Array:
        """Measured minus modelled in units of the noise, zero where nothing was measured, then the priors."""
        index, mean, sigma = self.priors()
        parts = [in_noise_units(_measured_only(response), noise).ravel() for response in self.responses(z)]
        return np.concatenate([*parts, (mean - z[index]) / sigma])

    def jacobian(self, z: Array, noise: Array) -> Array:
        """d residuals / d z."""
        index, _, sigma = self.priors()
        prior = np.zeros((index.size, z.size))
        prior[np.arange(index.size), index] = -1.0 / sigma
        parts = [-in_noise_units(block, noise).reshape(-1, z.size) for block in self.sensitivities(z)]
        return np.concatenate([*parts, prior])

    def check(self, z: Array) -> None:
        """Raises InputError with too few measurements, or where the model does not stay finite at ``z``."""
        available = sum(int(np.isfinite(m.outputs).sum()) for m in self.unknowns.manoeuvres)
        if available < 2 * z.size:
            raise InputError(
                f"{available} measured values for {z.size} unknowns; give longer manoeuvres or estimate less "
                "(fewer parameters, initial states and biases)"
            )
        for response in self.responses(z):
            size = 1.0 + np.abs(np.nan_to_num(response.measured)).max(axis=0)
            lost = np.argwhere(~(np.abs(response.modelled) < _DIVERGED * size))
            if lost.size:
                row, column = lost[0]
                raise InputError(
                    f"{response.name}: model {self.unknowns.model.name} diverges from its start values: "
                    f"{response.names[column]} is beyond all measure from {response.time[row]:.2f} s on; start nearer "
                    "to the aircraft (equation_error finds start values) or cut the flight into shorter manoeuvres"
                )


def inverted(information: Array) -> Array:
    """Inverse (n, n) of an information matrix; what has no information has no variance either."""
    return np.asarray(np.linalg.pinv(information, rcond=1e-14, hermitian=True), dtype=np.float64)


def _measured_only(response: ModelResponse) -> Array:
    """Residuals, zero where nothing was measured; where the model has no number, neither have they."""
    return np.where(np.isfinite(response.measured), response.residuals, 0.0)


def in_noise_units(rows: Array, noise: Array) -> Array:
    """``rows`` (N, ny, ...) in units of the noise (ny, ny): its inverse applied to the second axis."""
    if not np.any(np.tril(noise, -1)):
        return np.asarray(rows / np.diag(noise).reshape(1, -1, *(1,) * (rows.ndim - 2)))
    inverse = solve_triangular(noise, np.eye(len(noise)), lower=True)
    return np.asarray(np.moveaxis(np.tensordot(inverse, rows, axes=(1, 1)), 0, 1))


def maximise_likelihood(problem: LikelihoodProblem, search: SearchOptions) -> tuple[Array, int, str]:
    """The unknowns of maximum likelihood, the rounds it took, and a complaint where it did not converge."""
    z = problem.start()
    problem.check(z)
    moved, evaluations = np.inf, search.early
    for iteration in range(1, search.rounds + 1):
        previous, noise = z, problem.noise(z)
        z = weighted_least_squares(problem, z, np.arange(z.size), noise, evaluations)
        # |J dz| bounds every |dz_i| over its standard error
        moved = float(np.linalg.norm(problem.jacobian(z, noise) @ (z - previous)))
        if moved < search.tolerance and evaluations == search.evaluations:
            return z, iteration, ""
        # so few evaluations may also have found no step at all
        evaluations = search.evaluations if moved < search.tolerance else search.early
    return (
        z,
        search.rounds,
        f"not converged after {search.rounds} rounds of noise relaxation: the last moved the estimates by up to "
        f"{moved:.2g} standard errors",
    )


def weighted_least_squares(
    problem: LikelihoodProblem, z: Array, chosen: NDArray[np.intp], noise: Array, evaluations: int
) -> Array:
    """The unknowns with those of index ``chosen`` moved to the least squares for this noise."""

    def moved(x: Array) -> Array:
        full = z.copy()
        full[chosen] = x
        return full

    def residuals(x: Array) -> Array:
        return problem.residuals(moved(x), noise)

    def jacobian(x: Array) -> Array:
        return problem.jacobian(moved(x), noise)[:, chosen]

    lower, upper = problem.bounds()
    # a start value on its bound would leave the interior method no step
    inside = np.clip(z[chosen], lower[chosen], upper[chosen])
    with np.errstate(over="ignore", invalid="ignore"):  # a step so far that the model diverges is taken back
        solution = least_squares(
            residuals,
            inside,
            jacobian,
            bounds=(lower[chosen], upper[chosen]),
            x_scale="jac",
            max_nfev=evaluations,
        )
    return moved(solution.x)


def responses_with_nuisances_estimated(problem: LikelihoodProblem, z: Array) -> list[ModelResponse]:
    """The model's answers at ``z``, with only the manoeuvres' own unknowns (initial states, biases) estimated."""
    problem.check(z)
    own = np.arange(len(problem.unknowns.free), problem.unknowns.size)
    for _ in range(_OWN_ROUNDS if own.size else 0):
        z = weighted_least_squares(problem, z, own, problem.noise(z), DEFAULT_SEARCH.evaluations)
    return problem.responses(z)
