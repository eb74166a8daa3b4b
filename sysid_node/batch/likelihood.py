"""What output error and filter error share: maximum likelihood by alternating between noise and parameters.

The likelihood of N(0, R) residuals with unknown R is largest where det R of the sample covariance is smallest
(Maine & Iliff, 1986, sec. 5.2). Relaxation gets there by least squares weighted with the present R, then a new R, until
neither moves (Jategaonkar, 2015, sec. 4.6).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from sysid_node.batch.result import Answer
from sysid_node.batch.unknowns import Priors, Unknowns
from sysid_node.errors import InputError
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class Search:
    """How long to look: rounds of noise relaxation, and model evaluations within each.

    Converged once a whole round moves no unknown by more than ``tolerance`` of its standard error. ``early``
    evaluations are enough for a round that another will follow; the last has ``evaluations``.
    """

    rounds: int = 60
    evaluations: int = 50
    tolerance: float = 1e-3
    early: int = 50


DEFAULT_SEARCH = Search()

#: A model whose answer is so many times the measurement has diverged.
_DIVERGED = 1e6

#: Rounds of noise relaxation for initial states and biases alone.
_OWN_ROUNDS = 4


class Problem(ABC):
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
    def answers(self, z: Array) -> list[Answer]:
        """What the model makes of each manoeuvre."""

    @abstractmethod
    def sensitivities(self, z: Array) -> list[Array]:
        """d modelled / d z[columns] (N, ny, k) of each manoeuvre, zero where nothing was measured."""

    def priors(self) -> Priors:
        """What is known beforehand: indices into z, means, 1-sigma uncertainties."""
        return self.unknowns.priors()

    def noise(self, z: Array) -> Array:
        """Lower Cholesky factor (ny, ny) of the residuals' covariance: here independent outputs.

        No output's noise is taken to be below a rounding error of its size.
        """
        answers = self.answers(z)
        residuals = np.concatenate([answer.residuals for answer in answers])
        size = np.nanmax(np.abs(np.concatenate([answer.measured for answer in answers])), axis=0, initial=0.0)
        return np.diag(np.maximum(np.sqrt(np.nanmean(residuals**2, axis=0)), 1e-12 * (1.0 + size)))

    def weighted(self, z: Array, noise: Array) -> tuple[list[Array], list[Array]]:
        """Residuals (N, ny), zero where nothing was measured, and sensitivities (N, ny, n), in units of the noise."""
        residuals = [whitened(_measured_only(answer), noise) for answer in self.answers(z)]
        blocks = []
        for i, block in enumerate(self.sensitivities(z)):
            blocks.append(np.zeros((*block.shape[:2], z.size)))
            blocks[-1][:, :, self.columns(i, z)] = whitened(block, noise)
        return residuals, blocks

    def cost(self, z: Array, noise: Array) -> float:
        """Sum of squares of the residuals in units of the noise, and of the priors'."""
        index, mean, sigma = self.priors()
        squares = [float(np.sum(whitened(_measured_only(answer), noise) ** 2)) for answer in self.answers(z)]
        return sum(squares) + float(np.sum(((mean - z[index]) / sigma) ** 2))

    def normal(self, z: Array, noise: Array) -> tuple[Array, Array]:
        """Information (n, n) and moment (n,) of the unknowns, half the cost's curvature and negative slope."""
        information, moment = np.zeros((z.size, z.size)), np.zeros(z.size)
        for i, (answer, block) in enumerate(zip(self.answers(z), self.sensitivities(z), strict=True)):
            columns = self.columns(i, z)
            slopes = whitened(block, noise).reshape(-1, len(columns))
            information[np.ix_(columns, columns)] += slopes.T @ slopes
            moment[columns] += slopes.T @ whitened(_measured_only(answer), noise).ravel()
        index, mean, sigma = self.priors()
        information[index, index] += 1.0 / sigma**2
        moment[index] += (mean - z[index]) / sigma**2
        return information, moment

    def columns(self, index: int, z: Array) -> list[int]:
        """Where in z the quantities stand that a manoeuvre depends on: the common ones, its own, a method's."""
        own = self.unknowns.own(index)
        return [*range(len(self.unknowns.free)), *range(own.start, own.stop), *range(self.unknowns.size, z.size)]

    def check(self, z: Array) -> None:
        """Raises InputError with too few measurements, or where the model does not stay finite at ``z``."""
        available = sum(int(np.isfinite(m.outputs).sum()) for m in self.unknowns.manoeuvres)
        if available < 2 * z.size:
            raise InputError(
                f"{available} measured values for {z.size} unknowns; give longer manoeuvres or estimate less "
                "(fewer parameters, initial states and biases)"
            )
        for answer in self.answers(z):
            size = 1.0 + np.abs(np.nan_to_num(answer.measured)).max(axis=0)
            lost = np.argwhere(~(np.abs(answer.modelled) < _DIVERGED * size))
            if lost.size:
                row, column = lost[0]
                raise InputError(
                    f"{answer.name}: model {self.unknowns.model.name} diverges from its start values: "
                    f"{answer.names[column]} is beyond all measure from {answer.time[row]:.2f} s on; start nearer "
                    "to the aircraft (equation_error finds start values) or cut the flight into shorter manoeuvres"
                )


def _measured_only(answer: Answer) -> Array:
    """Residuals, zero where nothing was measured; where the model has no number, neither have they."""
    return np.where(np.isfinite(answer.measured), answer.residuals, 0.0)


def whitened(rows: Array, noise: Array) -> Array:
    """``rows`` (N, ny, ...) in units of the noise (ny, ny): its inverse applied to the second axis."""
    if not np.any(np.tril(noise, -1)):
        return np.asarray(rows / np.diag(noise).reshape(1, -1, *(1,) * (rows.ndim - 2)))
    inverse = solve_triangular(noise, np.eye(len(noise)), lower=True)
    return np.asarray(np.moveaxis(np.tensordot(inverse, rows, axes=(1, 1)), 0, 1))


def maximise(problem: Problem, search: Search) -> tuple[Array, int, str]:
    """The unknowns of maximum likelihood, the rounds it took, and a complaint where it did not converge."""
    z = problem.start()
    problem.check(z)
    moved, evaluations = np.inf, search.early
    for iteration in range(1, search.rounds + 1):
        previous, noise = z, problem.noise(z)
        z, information = weighted_least_squares(problem, z, np.arange(z.size), noise, evaluations)
        # bounds every |dz_i| over its standard error
        moved = float(np.sqrt(max(0.0, float((z - previous) @ information @ (z - previous)))))
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
    problem: Problem, z: Array, chosen: NDArray[np.intp], noise: Array, evaluations: int
) -> tuple[Array, Array]:
    """The unknowns with those of index ``chosen`` moved to the least squares for this noise; their information there.

    The optimiser sees as many residuals as unknowns and one more, with the same cost, slope and curvature: a hundred
    thousand samples at a hundred unknowns would keep it busy with their singular values.
    """
    information = np.zeros((chosen.size, chosen.size))

    def moved(x: Array) -> Array:
        full = z.copy()
        full[chosen] = x
        return full

    def residuals(x: Array) -> Array:
        return np.append(np.zeros(chosen.size), np.sqrt(problem.cost(moved(x), noise)))

    def jacobian(x: Array) -> Array:
        whole, moment = problem.normal(moved(x), noise)
        information[:] = whole[np.ix_(chosen, chosen)]
        return _condensed(information, moment[chosen], residuals(x)[-1])

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
    return moved(solution.x), information


def _condensed(information: Array, moment: Array, size: float) -> Array:
    """J (n + 1, n) with J' J = ``information`` and J' f = -``moment`` for the residuals f = (0, ..., 0, ``size``)."""
    last = -moment / size if size > 0.0 else np.zeros(moment.size)
    scale = np.sqrt(np.diag(information))
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh((information - np.outer(last, last)) / np.outer(scale, scale))
    root = np.sqrt(np.clip(values, 0.0, None))[:, None] * vectors.T * scale
    return np.vstack([root, last])


def answer_with_own(problem: Problem, z: Array) -> list[Answer]:
    """The model's answers at ``z``, with only the manoeuvres' own unknowns (initial states, biases) estimated."""
    problem.check(z)
    own = np.arange(len(problem.unknowns.free), problem.unknowns.size)
    for _ in range(_OWN_ROUNDS if own.size else 0):
        z, _ = weighted_least_squares(problem, z, own, problem.noise(z), DEFAULT_SEARCH.evaluations)
    return problem.answers(z)
