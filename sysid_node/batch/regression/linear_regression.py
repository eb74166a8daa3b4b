"""Linear regression of one quantity on others, with standard errors for coloured residuals."""

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
from sysid_node.batch.results.identifiability import UnidentifiableGroups, identifiability_status, unidentifiable_groups
from sysid_node.errors import InputError
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class Regression:
    """Estimates by name, their covariance (p, p), and the modelled quantity (N,) of each flight.

    ``noise`` is the residuals' standard deviation; ``lost`` names what the data cannot tell apart.
    """

    estimates: dict[str, ParameterEstimate]
    covariance: Array
    modelled: list[Array]
    noise: float
    lost: UnidentifiableGroups


def regress(
    names: Sequence[str],
    ys: Sequence[Array],
    Xs: Sequence[Array],
    instruments: Sequence[Array] | None = None,
    freedom: float = np.inf,
    noisy: Sequence[ErrorsInVariables] = (),
) -> Regression:
    """Least squares of ``ys`` (N,) on ``Xs`` (N, p), several flights together.

    ``instruments`` (N, p) replace X in the normal equations Z' (y - X theta) = 0, for least squares in a band of
    frequencies; Z' X must be symmetric. ``freedom`` is the most degrees of freedom that the intervals may count on.
    ``noisy``: what is known of the regressors' noise, flight by flight.
    Regressors that the data cannot tell apart share their effect (minimum norm) and are marked invalid. Raises
    InputError with fewer than twice as many samples as regressors.
    """
    samples = sum(len(y) for y in ys)
    if samples < 2 * len(names):
        raise InputError(f"{samples} samples for {len(names)} regressors ({', '.join(names)}); give a longer flight")
    Zs = Xs if instruments is None else instruments
    information: Array = np.sum([Z.T @ X for Z, X in zip(Zs, Xs, strict=True)], axis=0)
    lost = unidentifiable_groups(information, names)
    moment: Array = np.sum([Z.T @ y for Z, y in zip(Zs, ys, strict=True)], axis=0)
    if noisy and not lost:
        information, moment = corrected_normal_equations(information, moment, noisy)
    inverse = _inverse(0.5 * (information + information.T))
    values = inverse @ moment
    modelled = [X @ values for X in Xs]
    residuals = [y - m for y, m in zip(ys, modelled, strict=True)]
    noise = float(np.sqrt(np.mean(np.concatenate(residuals) ** 2)))
    covariance = coloured_covariance(
        inverse, [X[:, None, :] for X in Xs], [r[:, None] for r in residuals], [Z[:, None, :] for Z in Zs]
    )
    if noisy:
        covariance = inflated_covariance(covariance, inverse, values, noisy)
    scatter: Array = np.sum([Z.T @ Z for Z in Zs], axis=0)
    white = noise * np.sqrt(np.clip(np.diag(inverse @ scatter @ inverse), 0.0, None) * samples / (samples - len(names)))
    freedom = min(freedom, spectral_degrees_of_freedom([len(y) for y in ys]))
    errors = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    estimates = {
        name: _estimate(
            name, float(values[i]), float(errors[i]), freedom, float(white[i]), identifiability_status(name, lost)
        )
        for i, name in enumerate(names)
    }
    return Regression(estimates, covariance, modelled, noise, lost)


def _inverse(information: Array) -> Array:
    """Pseudo-inverse, the regressors' different sizes aside."""
    scale = np.sqrt(np.clip(np.diag(information), 0.0, None))
    sizes = np.outer(np.where(scale > 0.0, scale, 1.0), np.where(scale > 0.0, scale, 1.0))
    return np.asarray(np.linalg.pinv(information / sizes, rcond=1e-12, hermitian=True) / sizes)


def _estimate(name: str, value: float, error: float, freedom: float, white: float, status: str) -> ParameterEstimate:
    lower, upper = confidence_interval(value, error, freedom)
    return ParameterEstimate(name, value, error, lower, upper, status == "ok", status, white)
