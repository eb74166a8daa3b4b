"""A maximum-likelihood estimation as functions of the vector of unknowns.

The residuals of all outputs are N(0, R) with an unknown R. A method supplies the model's responses and their
sensitivities; what the search and the covariance need follows from these.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_triangular

from sysid_node.batch.likelihood.unknowns import Priors, Unknowns
from sysid_node.batch.regression.coloured_residuals import coloured_covariance, spectral_degrees_of_freedom
from sysid_node.batch.results.response import ModelResponse
from sysid_node.errors import InputError
from sysid_node.flight.record import Array

#: A model whose response is so many times the measurement has diverged.
_DIVERGED = 1e6


class LikelihoodProblem(ABC):
    """An estimation as functions of the vector z (n,): the unknowns, then what a method adds to them."""

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
        """The model's response to each manoeuvre."""

    @abstractmethod
    def sensitivities(self, z: Array) -> list[Array]:
        """d modelled / d z (N, ny, n) of each manoeuvre, zero where nothing was measured."""

    def priors(self) -> Priors:
        """Prior knowledge: indices into z, means, 1-sigma uncertainties."""
        return self.unknowns.priors()

    def noise(self, z: Array) -> Array:
        """Lower Cholesky factor (ny, ny) of the residuals' covariance: here independent outputs.

        The noise of an output is at least a rounding error of its size.
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
        """The covariance (n, n) of the estimates and its degrees of freedom, from what ``weighted`` returns.

        Here the residuals may have any colour, but the sensitivities are independent of the noise.
        """
        freedom = spectral_degrees_of_freedom([len(errors) for errors in residuals])
        return coloured_covariance(inverted(information), sensitivities, residuals), freedom

    def residuals(self, z: Array, noise: Array) -> Array:
        """The residuals in units of the noise, zero where nothing was measured, then those of the priors."""
        index, mean, sigma = self.priors()
        parts = [in_noise_units(_measured_only(response), noise).ravel() for response in self.responses(z)]
        return np.concatenate([*parts, (mean - z[index]) / sigma])

    def jacobian(self, z: Array, noise: Array) -> Array:
        """The Jacobian of ``residuals`` with respect to z; raises InputError where it is not finite."""
        index, _, sigma = self.priors()
        prior = np.zeros((index.size, z.size))
        prior[np.arange(index.size), index] = -1.0 / sigma
        parts = [-in_noise_units(block, noise).reshape(-1, z.size) for block in self.sensitivities(z)]
        found = np.concatenate([*parts, prior])
        if not np.isfinite(found).all():
            raise InputError(
                f"model {self.unknowns.model.name} becomes so unstable in the search that its sensitivities exceed all "
                "numbers; cut the flight into shorter pieces (segment), use the aircraft file's tolerances "
                "(use_prior), or leave out what the flight does not move (states)"
            )
        return found

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
            diverged = np.argwhere(~(np.abs(response.modelled) < _DIVERGED * size))
            if diverged.size:
                row, column = diverged[0]
                raise InputError(
                    f"{response.name}: model {self.unknowns.model.name} diverges from its start values: "
                    f"{response.names[column]} is more than a million times the measurement from "
                    f"{response.time[row]:.2f} s on; cut the flight into shorter pieces (segment), leave out what the "
                    "flight does not move (states), or give an aircraft file that is nearer to the aircraft"
                )


def inverted(information: Array) -> Array:
    """The pseudo-inverse (n, n) of an information matrix; what has no information gets no variance."""
    return np.asarray(np.linalg.pinv(information, rcond=1e-14, hermitian=True), dtype=np.float64)


def _measured_only(response: ModelResponse) -> Array:
    """The residuals, zero where nothing was measured; not finite where the model is not."""
    return np.where(np.isfinite(response.measured), response.residuals, 0.0)


def in_noise_units(rows: Array, noise: Array) -> Array:
    """``rows`` (N, ny, ...) in units of the noise: the inverse of its Cholesky factor (ny, ny) on the second axis."""
    if not np.any(np.tril(noise, -1)):
        return np.asarray(rows / np.diag(noise).reshape(1, -1, *(1,) * (rows.ndim - 2)))
    inverse = solve_triangular(noise, np.eye(len(noise)), lower=True)
    return np.asarray(np.moveaxis(np.tensordot(inverse, rows, axes=(1, 1)), 0, 1))
