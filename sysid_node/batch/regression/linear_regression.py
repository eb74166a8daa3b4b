"""Linear regression of one quantity on others, with standard errors for coloured residuals.

Klein & Morelli, "Aircraft System Identification" (2006), ch. 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sysid_node.batch.regression.coloured_residuals import coloured_covariance, spectral_degrees_of_freedom
from sysid_node.batch.regression.errors_in_variables import (
    ErrorsInVariables,
    corrected_normal_equations,
    inflated_covariance,
)
from sysid_node.batch.results.estimate import ParameterEstimate, confidence_interval
from sysid_node.batch.results.identifiability import (
    UnidentifiableGroups,
    identifiability_status,
    unidentifiable_groups,
)
from sysid_node.errors import InputError
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class Regression:
    """Estimates by name, their covariance (p, p), and the modelled quantity (N,) of each flight.

    ``noise`` is the residuals' standard deviation; ``unidentifiable`` names the regressors that the data do not
    distinguish from one another.
    """

    estimates: dict[str, ParameterEstimate]
    covariance: Array
    modelled: list[Array]
    noise: float
    unidentifiable: UnidentifiableGroups


def regress(
    names: Sequence[str],
    ys: Sequence[Array],
    Xs: Sequence[Array],
    instruments: Sequence[Array] | None = None,
    most_freedom: float = np.inf,
    sensor_errors: Sequence[ErrorsInVariables] = (),
) -> Regression:
    """Least squares of ``ys`` (N,) on ``Xs`` (N, p), several flights together.

    ``instruments`` (N, p) replace X in the normal equations Z' (y - X theta) = 0, for least squares in a band of
    frequencies; Z' X must be symmetric. ``most_freedom`` bounds the degrees of freedom of the intervals.
    ``sensor_errors``: what is known of the regressors' noise, flight by flight. Regressors that the data do not
    distinguish share their effect (minimum norm) and are marked invalid. Raises InputError with fewer than twice as
    many samples as regressors.
    """
    samples = sum(len(y) for y in ys)
    if samples < 2 * len(names):
        raise InputError(f"{samples} samples for {len(names)} regressors ({', '.join(names)}); give a longer flight")
    Zs = Xs if instruments is None else instruments
    information: Array = np.sum([Z.T @ X for Z, X in zip(Zs, Xs, strict=True)], axis=0)
    moment: Array = np.sum([Z.T @ y for Z, y in zip(Zs, ys, strict=True)], axis=0)
    unidentifiable = unidentifiable_groups(information, names)
    if sensor_errors and not unidentifiable:
        information, moment = corrected_normal_equations(information, moment, sensor_errors)
    inverse = _inverse(0.5 * (information + information.T))
    values = inverse @ moment
    modelled = [X @ values for X in Xs]
    residuals = [y - m for y, m in zip(ys, modelled, strict=True)]
    noise = float(np.sqrt(np.mean(np.concatenate(residuals) ** 2)))
    covariance = coloured_covariance(
        inverse, [X[:, None, :] for X in Xs], [r[:, None] for r in residuals], [Z[:, None, :] for Z in Zs]
    )
    if sensor_errors:
        covariance = inflated_covariance(covariance, inverse, values, sensor_errors)
    freedom = min(most_freedom, spectral_degrees_of_freedom([len(y) for y in ys]))
    white = noise * _white_errors(inverse, Zs)
    estimates = _estimates(names, values, covariance, white, freedom, unidentifiable)
    return Regression(estimates, covariance, modelled, noise, unidentifiable)


def _white_errors(inverse: Array, Zs: Sequence[Array]) -> Array:
    """Standard errors (p,) for white residuals of unit variance, counting the degrees of freedom that the fit takes."""
    samples, unknowns = sum(len(Z) for Z in Zs), len(inverse)
    scatter: Array = np.sum([Z.T @ Z for Z in Zs], axis=0)
    variances = np.clip(np.diag(inverse @ scatter @ inverse), 0.0, None)
    return np.asarray(np.sqrt(variances * samples / (samples - unknowns)))


def _inverse(information: Array) -> Array:
    """The pseudo-inverse (p, p), computed after the regressors are scaled to unit size."""
    scale = np.sqrt(np.clip(np.diag(information), 0.0, None))
    sizes = np.outer(np.where(scale > 0.0, scale, 1.0), np.where(scale > 0.0, scale, 1.0))
    return np.asarray(np.linalg.pinv(information / sizes, rcond=1e-12, hermitian=True) / sizes)


def _estimates(
    names: Sequence[str],
    values: Array,
    covariance: Array,
    white_errors: Array,
    freedom: float,
    unidentifiable: UnidentifiableGroups,
) -> dict[str, ParameterEstimate]:
    """The estimates by name, with 95 % intervals of Student's t."""
    errors = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    estimates = {}
    for name, value, error, white in zip(names, values, errors, white_errors, strict=True):
        lower, upper = confidence_interval(float(value), float(error), freedom)
        status = identifiability_status(name, unidentifiable)
        estimates[name] = ParameterEstimate(
            name, float(value), float(error), lower, upper, status == "ok", status, float(white)
        )
    return estimates
