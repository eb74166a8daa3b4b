"""The outcome of a batch method: estimates, their covariance, and the model's responses to the flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from sysid_node.batch.results.estimate import ParameterEstimate
from sysid_node.batch.results.parameter_track import ParameterTrack
from sysid_node.batch.results.response import ModelResponse
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class SearchEnd:
    """How the search for the estimates ended, in ``message`` in words."""

    converged: bool
    iterations: int
    message: str
    unknowns: Array | None = None  # (n,) with which a search for the maximum likelihood ended


@dataclass(frozen=True)
class SystematicPart:
    """What the flights tell of the imperfections that every method has in common; empty where it was not asked."""

    servos: Mapping[str, ParameterEstimate] = field(default_factory=dict)  # by control: how late it follows, s
    budget: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # shares of each variance by source
    covariance: Array | None = None  # (P, P) the part of the fit's covariance that they make


@dataclass(frozen=True)
class BatchFit:
    """The outcome of one estimation.

    ``covariance`` (P, P) of the parameters in the order of ``estimates``, for coloured residuals. ``noise`` is the
    residuals' standard deviation by output; ``log_det`` = ln det R, which maximum likelihood minimises (of equation
    error: of the equations' residual variances). ``nuisance`` holds what else was estimated for each manoeuvre
    (initial states, biases). ``remarks`` are sentences for the reader: which parameters are not distinguished, which
    lie at a bound, what was left out.
    """

    method: str
    estimates: Mapping[str, ParameterEstimate]
    covariance: Array
    noise: Mapping[str, float]
    log_det: float
    responses: Sequence[ModelResponse]
    search: SearchEnd
    remarks: tuple[str, ...] = ()
    nuisance: Sequence[Mapping[str, float]] = ()
    extras: Mapping[str, float] = field(default_factory=dict)  # e.g. process noise
    systematic: SystematicPart = SystematicPart()
    track: ParameterTrack | None = None  # estimates over time, of a filter that passes once along the flights

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by name."""
        return {name: estimate.value for name, estimate in self.estimates.items()}

    @property
    def correlation(self) -> Array:
        """Correlation coefficients (P, P) of the estimates."""
        return correlation_matrix(self.covariance)


def correlation_matrix(covariance: Array) -> Array:
    """The correlation matrix of a covariance; zero where a variance is zero."""
    deviation = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    with np.errstate(divide="ignore", invalid="ignore"):
        scaled = covariance / np.outer(deviation, deviation)
    result = np.where(np.isfinite(scaled), scaled, 0.0)
    np.fill_diagonal(result, 1.0)
    return result
