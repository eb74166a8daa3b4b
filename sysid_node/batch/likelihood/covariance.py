"""The fit at the end of a search: covariance, intervals, and which estimates are not valid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sysid_node.batch.likelihood.problem import LikelihoodProblem, inverted
from sysid_node.batch.likelihood.unknowns import Unknowns
from sysid_node.batch.results.batch_fit import BatchFit, SearchEnd
from sysid_node.batch.results.estimate import ParameterEstimate, confidence_interval
from sysid_node.batch.results.identifiability import (
    UnidentifiableGroups,
    identifiability_remarks,
    identifiability_status,
    unidentifiable_groups,
)
from sysid_node.flight.record import Array


def assessed_fit(
    method: str,
    problem: LikelihoodProblem,
    z: Array,
    iterations: int,
    complaint: str,
    extras: Mapping[str, float] | None = None,
) -> BatchFit:
    """The fit at the unknowns ``z`` (n,) that a search of ``iterations`` rounds ended with.

    ``complaint`` says how the search failed to converge, or is empty.
    """
    unknowns, noise, responses = problem.unknowns, problem.noise(z), problem.responses(z)
    residuals, sensitivities = problem.weighted(z, noise)
    information = _information(problem, sensitivities)
    count = len(unknowns.free)
    groups = unidentifiable_groups(_condensed(information, count), unknowns.names)
    whole, freedom = problem.covariance(information, sensitivities, residuals)
    covariance = whole[:count, :count]
    status = _status(unknowns, z, groups)
    at_bounds = [f"{name} ended {text}" for name, text in status.items() if text.startswith("at its")]
    return BatchFit(
        method=method,
        estimates=_estimates(z, covariance, freedom, status, np.diag(inverted(information))),
        covariance=covariance,
        noise=dict(zip(unknowns.model.outputs, np.linalg.norm(noise, axis=1).tolist(), strict=True)),
        log_det=float(2.0 * np.sum(np.log(np.diag(noise)))),
        responses=responses,
        search=SearchEnd(
            converged=not complaint,
            iterations=iterations,
            message=complaint or f"converged after {iterations} rounds of noise relaxation",
            unknowns=z,
        ),
        remarks=(*at_bounds, *identifiability_remarks(covariance, unknowns.names, groups)),
        nuisance=unknowns.nuisance(z),
        extras=extras or {},
    )


def _estimates(
    z: Array, covariance: Array, freedom: float, status: Mapping[str, str], white_variances: Array
) -> dict[str, ParameterEstimate]:
    """The estimates of the parameters named in ``status``, which stand first in ``z`` (n,)."""
    white_errors = np.sqrt(np.clip(white_variances, 0.0, None))
    estimates = {}
    for i, (name, text) in enumerate(status.items()):
        value, error = float(z[i]), float(np.sqrt(covariance[i, i]))
        lower, upper = confidence_interval(value, error, freedom)
        estimates[name] = ParameterEstimate(
            name, value, error, lower, upper, text == "ok", text, float(white_errors[i])
        )
    return estimates


def _information(problem: LikelihoodProblem, sensitivities: Sequence[Array]) -> Array:
    """The Fisher information (n, n) of data and priors."""
    parts = [np.tensordot(block, block, axes=([0, 1], [0, 1])) for block in sensitivities]
    information: Array = np.sum(parts, axis=0)
    index, _, sigma = problem.priors()
    information[index, index] += 1.0 / sigma**2
    return information


def _condensed(information: Array, count: int) -> Array:
    """The information (count, count) on the parameters where initial states and biases are estimated as well."""
    if information.shape[0] == count:
        return information
    nuisances = information[count:, count:]
    cross = information[:count, count:]
    condensed = information[:count, :count] - cross @ np.linalg.pinv(nuisances, rcond=1e-14, hermitian=True) @ cross.T
    return np.asarray(0.5 * (condensed + condensed.T))


def _status(unknowns: Unknowns, z: Array, groups: UnidentifiableGroups) -> dict[str, str]:
    """The status of each parameter: "ok", or why its estimate is not valid."""
    lower, upper = unknowns.bounds()
    status = {}
    for i, name in enumerate(unknowns.names):
        margin = 1e-6 * max(1.0, abs(z[i]))
        status[name] = identifiability_status(name, groups)
        if status[name] == "ok" and z[i] - lower[i] < margin:
            status[name] = f"at its lower bound {lower[i]:g}"
        elif status[name] == "ok" and upper[i] - z[i] < margin:
            status[name] = f"at its upper bound {upper[i]:g}"
    return status
