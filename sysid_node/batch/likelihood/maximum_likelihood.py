"""Maximum likelihood by alternating between the noise covariance and the unknowns (relaxation).

The likelihood of N(0, R) residuals with unknown R is largest where the determinant of their sample covariance is
smallest (Maine & Iliff, NASA RP-1168, 1986, sec. 5.2). Relaxation reaches it by least squares weighted with the present
R, followed by a new R, until neither changes (Jategaonkar, 2015, sec. 4.6).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from sysid_node.batch.likelihood.problem import LikelihoodProblem
from sysid_node.batch.results.response import ModelResponse
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class SearchOptions:
    """The limits of a search: rounds of noise relaxation, and model evaluations within each.

    The search has converged once a whole round moves no unknown by more than ``tolerance`` of its standard error.
    ``early`` limits the evaluations of a round until one of so few moves no unknown; all further rounds have
    ``evaluations``.
    """

    rounds: int = 60
    evaluations: int = 50
    tolerance: float = 1e-3
    early: int = 50


DEFAULT_SEARCH = SearchOptions()

#: Rounds of noise relaxation for initial states and biases alone.
_NUISANCE_ROUNDS = 4


def maximise_likelihood(problem: LikelihoodProblem, search: SearchOptions) -> tuple[Array, int, str]:
    """The unknowns (n,) of maximum likelihood, the number of rounds, and a message where it did not converge."""
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
        # A round of few evaluations may find no step at all. The next one would find none either.
        evaluations = search.evaluations if moved < search.tolerance else evaluations
    return (
        z,
        search.rounds,
        f"not converged after {search.rounds} rounds of noise relaxation: the last moved the estimates by up to "
        f"{moved:.2g} standard errors",
    )


def weighted_least_squares(
    problem: LikelihoodProblem, z: Array, chosen: NDArray[np.intp], noise: Array, evaluations: int
) -> Array:
    """The unknowns (n,) with those of index ``chosen`` moved to the least-squares solution for this noise."""

    def moved(x: Array) -> Array:
        full = z.copy()
        full[chosen] = x
        return full

    def residuals(x: Array) -> Array:
        return problem.residuals(moved(x), noise)

    def jacobian(x: Array) -> Array:
        return problem.jacobian(moved(x), noise)[:, chosen]

    lower, upper = problem.bounds()
    # the interior-point method cannot start on a bound
    inside = np.clip(z[chosen], lower[chosen], upper[chosen])
    with np.errstate(over="ignore", invalid="ignore"):  # the search takes back a step at which the model diverges
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
    """The model's responses with the parameters of ``z``, only initial states and biases being estimated."""
    problem.check(z)
    nuisances = np.arange(len(problem.unknowns.free), problem.unknowns.size)
    for _ in range(_NUISANCE_ROUNDS if nuisances.size else 0):
        z = weighted_least_squares(problem, z, nuisances, problem.noise(z), DEFAULT_SEARCH.evaluations)
    return problem.responses(z)
