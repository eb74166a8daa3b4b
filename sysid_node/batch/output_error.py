"""Maximum likelihood by output error: the constants with which the model's own flight is nearest to the measured one.

Maine & Iliff, "Application of Parameter Estimation to Aircraft Stability and Control", NASA RP-1168 (1986), ch. 6;
Jategaonkar, "Flight Vehicle System Identification", 2nd ed. (2015), ch. 4. The flight must be free of turbulence: what
the wind does is taken for an answer to the controls, and the estimates are biased (``filter_error`` knows better).

The noise covariance is diagonal and found by relaxation (Jategaonkar, eq. 4.15): parameters for the present noise, noise
from the new residuals, until neither moves. Each inner problem is solved by scipy's trust-region least squares with the
exact Jacobian from JAX; the start values' bounds and priors hold throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from sysid_node.batch import rollout
from sysid_node.batch.assess import assess
from sysid_node.batch.model import Manoeuvre, Model, check_manoeuvres
from sysid_node.batch.result import Answer, Fit
from sysid_node.batch.unknowns import Unknowns
from sysid_node.errors import InputError
from sysid_node.flight.record import Array

#: Converged once a whole round moves no unknown by more than this share of its standard error.
TOLERANCE = 1e-3


@dataclass(frozen=True)
class Search:
    """How long to look: rounds of noise relaxation, and model evaluations within each."""

    rounds: int = 40
    evaluations: int = 50


def output_error(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    *,
    initial_states: Sequence[str] = (),
    biases: Sequence[str] = (),
    search: Search = Search(),  # noqa: B008 - frozen
) -> Fit:
    """Estimates the free parameters of ``model`` from all manoeuvres together.

    ``initial_states`` are estimated for each manoeuvre (the others stay as given), and so are ``biases``, constants
    added to the outputs of these names. Raises InputError where the data do not fit the model, are too few, or the
    model diverges from its start values; a search that does not converge is returned, and says so.
    """
    check_manoeuvres(model, manoeuvres)
    problem = _Problem(Unknowns.of(model, manoeuvres, initial_states, biases))
    problem.check_size()
    z = problem.unknowns.start()
    problem.check_start(z)
    z, iterations, message = _relax(problem, z, search)
    noise = problem.noise(z)
    return assess(
        "output_error",
        problem.unknowns,
        z,
        sensitivities=problem.sensitivities(z),
        answers=problem.answers(z),
        noise=noise,
        converged=not message,
        iterations=iterations,
        message=message or f"converged after {iterations} rounds of noise relaxation",
    )


def predict(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    values: dict[str, float],
    *,
    initial_states: Sequence[str] = (),
    biases: Sequence[str] = (),
) -> list[Answer]:
    """The model's answers on other manoeuvres with the parameters held at ``values``.

    Initial states and biases belong to a manoeuvre, not to the aircraft: they are estimated, if any.
    """
    held = model.started_at(values)
    check_manoeuvres(held, manoeuvres)
    problem = _Problem(Unknowns.of(held, manoeuvres, initial_states, biases))
    z = problem.unknowns.start()
    problem.check_start(z)
    if problem.unknowns.per_manoeuvre:
        z = _fit_nuisance(problem, z)
    return problem.answers(z)


class _Problem:
    """Residuals and Jacobian of an output-error estimation as functions of the unknowns z (n,)."""

    def __init__(self, unknowns: Unknowns) -> None:
        self.unknowns = unknowns
        self.measured = [np.isfinite(m.outputs) for m in unknowns.manoeuvres]
        self.counts = np.maximum(sum(mask.sum(axis=0) for mask in self.measured), 1)
        self.prior_index, self.prior_mean, self.prior_sigma = unknowns.priors()

    def answers(self, z: Array) -> list[Answer]:
        u = self.unknowns
        theta = u.theta(z)
        return [
            Answer(m.name, m.time, u.model.outputs, m.outputs, self._outputs(z, theta, i))
            for i, m in enumerate(u.manoeuvres)
        ]

    def _outputs(self, z: Array, theta: Array, index: int) -> Array:
        u = self.unknowns
        modelled = rollout.outputs(u.model, u.manoeuvres[index], theta, u.initial_state(z, index))
        return modelled + u.bias(z, index)

    def noise(self, z: Array) -> Array:
        """Standard deviation (ny,) of each output's residual, at least a rounding error of its size."""
        squares = sum(np.nansum(answer.residuals**2, axis=0) for answer in self.answers(z))
        size = np.nanmax([np.nanmax(np.abs(m.outputs), axis=0, initial=0.0) for m in self.unknowns.manoeuvres], axis=0)
        return np.asarray(np.maximum(np.sqrt(squares / self.counts), 1e-12 * (1.0 + size)))

    def residuals(self, z: Array, noise: Array) -> Array:
        """Measured minus modelled in units of the noise, zero where nothing was measured, then the priors."""
        parts = [
            np.where(mask, answer.residuals / noise, 0.0).ravel()
            for mask, answer in zip(self.measured, self.answers(z), strict=True)
        ]
        return np.concatenate([*parts, (self.prior_mean - z[self.prior_index]) / self.prior_sigma])

    def sensitivities(self, z: Array) -> list[Array]:
        """d outputs / d z (N, ny, n) of each manoeuvre, zero where nothing was measured."""
        u = self.unknowns
        theta = u.theta(z)
        blocks = []
        for i, manoeuvre in enumerate(u.manoeuvres):
            block = np.zeros((*manoeuvre.outputs.shape, u.size))
            of_model = rollout.sensitivities(u.model, manoeuvre, theta, u.initial_state(z, i), u.free, u.states)
            own = u.own(i)
            block[:, :, : len(u.free)] = of_model[:, :, : len(u.free)]
            block[:, :, own.start : own.start + len(u.states)] = of_model[:, :, len(u.free) :]
            for k, output in enumerate(u.biases):
                block[:, output, own.start + len(u.states) + k] = 1.0
            block[~self.measured[i]] = 0.0
            blocks.append(block)
        return blocks

    def jacobian(self, z: Array, noise: Array) -> Array:
        """d residuals / d z."""
        parts = [-(block / noise[None, :, None]).reshape(-1, z.size) for block in self.sensitivities(z)]
        prior = np.zeros((self.prior_index.size, z.size))
        prior[np.arange(self.prior_index.size), self.prior_index] = -1.0 / self.prior_sigma
        return np.concatenate([*parts, prior])

    def check_size(self) -> None:
        """Raises InputError with fewer measurements than unknowns."""
        available = int(sum(mask.sum() for mask in self.measured))
        if available < 2 * self.unknowns.size:
            raise InputError(
                f"{available} measured values for {self.unknowns.size} unknowns; "
                "give longer manoeuvres or estimate less (fewer initial states and biases)"
            )

    def check_start(self, z: Array) -> None:
        """Raises InputError where the model does not stay finite from its start values."""
        for answer in self.answers(z):
            lost = ~np.isfinite(answer.modelled)
            if lost.any():
                row, column = np.argwhere(lost)[0]
                raise InputError(
                    f"{answer.name}: model {self.unknowns.model.name} diverges from its start values: "
                    f"{answer.names[column]} is not finite from {answer.time[row]:.2f} s on; give start values nearer "
                    "to the aircraft (equation_error finds some) or cut the flight into shorter manoeuvres"
                )


def _relax(problem: _Problem, z: Array, search: Search) -> tuple[Array, int, str]:
    """Alternates noise and parameters; returns the unknowns, the rounds, and a complaint or nothing."""
    moved = np.inf
    bounds = problem.unknowns.bounds()
    for iteration in range(1, search.rounds + 1):
        noise = problem.noise(z)
        solution = least_squares(
            problem.residuals,
            z,
            lambda x, noise=noise: problem.jacobian(x, noise),  # type: ignore[misc]
            bounds=bounds,
            x_scale="jac",
            max_nfev=search.evaluations,
            args=(noise,),
        )
        # |J dz| bounds every |dz_i| over its standard error
        moved = float(np.linalg.norm(solution.jac @ (solution.x - z)))
        z = solution.x
        if moved < TOLERANCE:
            return z, iteration, ""
    return z, search.rounds, (
        f"not converged after {search.rounds} rounds of noise relaxation: the last moved the estimates by up to "
        f"{moved:.2g} standard errors"
    )


def _fit_nuisance(problem: _Problem, z: Array) -> Array:
    """Initial states and biases with the parameters held, by the same relaxation."""
    own = np.arange(len(problem.unknowns.free), z.size)
    for _ in range(5):
        noise = problem.noise(z)

        def full(x: Array) -> Array:
            moved = z.copy()
            moved[own] = x
            return moved

        solution = least_squares(
            lambda x, noise=noise: problem.residuals(full(x), noise),  # type: ignore[misc]
            z[own],
            lambda x, noise=noise: problem.jacobian(full(x), noise)[:, own],  # type: ignore[misc]
            x_scale="jac",
        )
        z = full(solution.x)
    return z
