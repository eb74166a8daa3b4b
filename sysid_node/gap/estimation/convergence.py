"""A fit iterated until it converges: variable projection and weights from the residual's spectrum by turns."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised
from sysid_node.gap.estimation.spectral_weights import residual_power
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.residuals.parameter_priors import bounds

#: Most rounds of linearising the nuisances and computing the weights anew.
_ROUNDS = 8

#: Change of the deviance from one round to the next below which the fit counts as converged.
_CONVERGED = 0.3

#: Change of the deviance below which the point has hardly moved, so that the next round takes the slopes of the
#: round before. Slopes change by a small share of the step then, and the fit by less than that share of the step.
_NEAR = 10.0

#: Evaluations of the small nonlinear problem in each round.
_EVALUATIONS = 12


def converged(fit: CandidateFit, rounds: int = _ROUNDS) -> CandidateFit:
    """The fit at its maximum a posteriori, with the weights of its own residual, linearised there.

    Weights and linearised nuisances of one round may make the next one worse, so the likeliest of all rounds is
    returned. Raises LinAlgError where the prediction diverges.
    """
    best, least, last = fit, np.inf, np.inf
    near: VariableProjection | None = None
    for _ in range(rounds):
        problem = VariableProjection(fit, near)
        fit = _one_round(problem)
        residuals = [flight.residual for flight in fit.flights]
        pairs = zip(fit.flights, residuals, strict=True)
        fit = fit.with_powers([residual_power(flight.model, left, flight.point) for flight, left in pairs])
        deviance = fit.deviance
        if deviance < least:
            best, least = fit, deviance
        if not abs(deviance - last) >= _CONVERGED:
            break
        near = problem if abs(deviance - last) < _NEAR else None
        last = deviance
    if not np.isfinite(least):
        raise np.linalg.LinAlgError("the prediction diverges")
    return linearised(best)


def _one_round(problem: VariableProjection) -> CandidateFit:
    """The fit with the candidates' parameters and the nuisance parameters at their best for the weights it has."""
    fit, values = problem.fit, problem.fit.values
    if values.size:
        low, high = bounds(fit.simulator, fit.indices)
        start = np.clip(problem.joint_start(values, low, high), low + 1e-9, high - 1e-9)
        if not np.isfinite(problem.residual_and_slopes(start)).all():
            raise np.linalg.LinAlgError("the prediction diverges")
        solution = least_squares(
            problem.residual, start, problem.jacobian, bounds=(low, high),
            x_scale=fit.simulator.scales[list(fit.indices)], max_nfev=_EVALUATIONS, ftol=1e-4, xtol=1e-4, gtol=1e-6,
        )  # fmt: skip
        values = solution.x
    return fit.at(problem.points(values))
