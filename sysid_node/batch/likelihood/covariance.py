"""From a converged search to a Fit: covariance, intervals, and what deserves no trust."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sysid_node.batch.likelihood.maximum_likelihood import LikelihoodProblem, inverted
from sysid_node.batch.likelihood.unknowns import Unknowns
from sysid_node.batch.results.batch_fit import BatchFit
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
    """The Fit at the unknowns ``z`` (n,) that a search of ``iterations`` rounds ended with.

    ``complaint`` says how it failed to converge, or is empty.
    """
    unknowns, noise, responses = problem.unknowns, problem.noise(z), problem.responses(z)
    residuals, sensitivities = problem.weighted(z, noise)
    information = _information(problem, sensitivities)
    count = len(unknowns.free)
    lost = unidentifiable_groups(_condensed(information, count), unknowns.names)
    inverse = inverted(information)
    whole, freedom = problem.covariance(information, sensitivities, residuals)
    covariance = whole[:count, :count]
    white = np.sqrt(np.clip(np.diag(inverse)[:count], 0.0, None))
    status = _status(unknowns, z, lost)
    bounded = [f"{name} ended {text}" for name, text in status.items() if text.startswith("at its")]
    estimates = {
        name: _estimate(name, float(z[i]), float(np.sqrt(covariance[i, i])), freedom, status[name], float(white[i]))
        for i, name in enumerate(unknowns.names)
    }
    return BatchFit(
        method=method,
        estimates=estimates,
        covariance=covariance,
        noise=dict(zip(unknowns.model.outputs, np.linalg.norm(noise, axis=1).tolist(), strict=True)),
        log_det=float(2.0 * np.sum(np.log(np.diag(noise)))),
        responses=responses,
        converged=not complaint,
        iterations=iterations,
        message=complaint or f"converged after {iterations} rounds of noise relaxation",
        remarks=(*bounded, *identifiability_remarks(covariance, unknowns.names, lost)),
        nuisance=unknowns.nuisance(z),
        extras=extras or {},
    )


def _information(problem: LikelihoodProblem, sensitivities: Sequence[Array]) -> Array:
    """Fisher information (n, n), the priors' included."""
    parts = [np.tensordot(block, block, axes=([0, 1], [0, 1])) for block in sensitivities]
    information: Array = np.sum(parts, axis=0)
    index, _, sigma = problem.priors()
    information[index, index] += 1.0 / sigma**2
    return information


def _condensed(information: Array, count: int) -> Array:
    """Information (count, count) on the parameters once initial states and biases are estimated too."""
    if information.shape[0] == count:
        return information
    own = information[count:, count:]
    cross = information[:count, count:]
    condensed = information[:count, :count] - cross @ np.linalg.pinv(own, rcond=1e-14, hermitian=True) @ cross.T
    return np.asarray(0.5 * (condensed + condensed.T))


def _status(unknowns: Unknowns, z: Array, lost: UnidentifiableGroups) -> dict[str, str]:
    """ "ok", or why a parameter deserves no trust."""
    lower, upper = unknowns.bounds()
    status = {}
    for i, name in enumerate(unknowns.names):
        margin = 1e-6 * max(1.0, abs(z[i]))
        status[name] = identifiability_status(name, lost)
        if status[name] == "ok" and z[i] - lower[i] < margin:
            status[name] = f"at its lower bound {lower[i]:g}"
        elif status[name] == "ok" and upper[i] - z[i] < margin:
            status[name] = f"at its upper bound {upper[i]:g}"
    return status


def _estimate(name: str, value: float, error: float, freedom: float, status: str, white: float) -> ParameterEstimate:
    lower, upper = confidence_interval(value, error, freedom)
    return ParameterEstimate(name, value, error, lower, upper, status == "ok", status, white)
