"""What a batch estimator returns: estimates with honest intervals, and how well the model answers the flight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from sysid_node.flight.record import Array


@dataclass(frozen=True)
class ParameterEstimate:
    """One parameter: value, standard error for coloured residuals, 95 % interval, and whether to trust it.

    ``white_error`` is the Cramer-Rao bound, which holds for white residuals only. ``status`` is "ok", or says in
    words why the value is not valid.
    """

    name: str
    value: float
    standard_error: float
    lower: float
    upper: float
    valid: bool
    status: str
    white_error: float


@dataclass(frozen=True)
class GoodnessOfFit:
    """How well one output or coefficient is answered: R^2, the residual's root mean square in its unit, samples."""

    r_squared: float
    residual_std: float
    samples: int


@dataclass(frozen=True)
class ModelResponse:
    """Measured and modelled outputs (N, ny) of one manoeuvre, on its ``time`` (N,) s; NaN = not measured."""

    name: str
    time: Array
    names: tuple[str, ...]
    measured: Array
    modelled: Array

    @property
    def residuals(self) -> Array:
        """Measured minus modelled (N, ny)."""
        return self.measured - self.modelled

    def column(self, name: str) -> tuple[Array, Array]:
        """One output as measured and as modelled, (N,) each."""
        index = self.names.index(name)
        return self.measured[:, index], self.modelled[:, index]


@dataclass(frozen=True)
class BatchFit:
    """The outcome of one estimation.

    ``covariance`` (P, P) of the parameters in the order of ``estimates``, for coloured residuals. ``noise`` is the
    residuals' standard deviation by output; ``log_det`` = ln det R, what maximum likelihood minimises (of equation
    error: of the equations' residual variances). ``nuisance`` holds what was estimated besides for each manoeuvre
    (initial states, biases). ``converged`` and ``message`` say plainly how it ended; ``remarks`` are sentences for
    the reader: what cannot be told apart, what lies at a bound, what was left out.
    """

    method: str
    estimates: Mapping[str, ParameterEstimate]
    covariance: Array
    noise: Mapping[str, float]
    log_det: float
    responses: Sequence[ModelResponse]
    converged: bool
    iterations: int
    message: str
    remarks: tuple[str, ...] = ()
    nuisance: Sequence[Mapping[str, float]] = ()
    extras: Mapping[str, float] = field(default_factory=dict)  # e.g. process noise

    @property
    def values(self) -> dict[str, float]:
        """Parameter values by name."""
        return {name: estimate.value for name, estimate in self.estimates.items()}

    @property
    def correlation(self) -> Array:
        """Correlation coefficients (P, P) of the estimates."""
        return correlation_matrix(self.covariance)


def correlation_matrix(covariance: Array) -> Array:
    """Correlation matrix of a covariance; zero where a variance is zero."""
    deviation = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    with np.errstate(divide="ignore", invalid="ignore"):
        scaled = covariance / np.outer(deviation, deviation)
    result = np.where(np.isfinite(scaled), scaled, 0.0)
    np.fill_diagonal(result, 1.0)
    return result


def confidence_interval(value: float, standard_error: float, freedom: float) -> tuple[float, float]:
    """95 % interval with Student's t for the degrees of freedom of the residuals' spectrum."""
    half = float(stats.t.ppf(0.975, freedom)) * standard_error
    return value - half, value + half


def goodness_of_fit(responses: Sequence[ModelResponse]) -> dict[str, GoodnessOfFit]:
    """R^2 and residual by output, over all answers together."""
    names = dict.fromkeys(name for response in responses for name in response.names)
    return {name: _goodness_of_fit([a.column(name) for a in responses if name in a.names]) for name in names}


def _goodness_of_fit(pairs: Sequence[tuple[Array, Array]]) -> GoodnessOfFit:
    measured, modelled = (np.concatenate(part) for part in zip(*pairs, strict=True))
    kept = np.isfinite(measured - modelled)
    samples = int(kept.sum())
    if not samples:
        return GoodnessOfFit(float("nan"), float("nan"), 0)
    squares = float(np.sum((measured - modelled)[kept] ** 2))
    spread = float(np.sum((measured[kept] - measured[kept].mean()) ** 2))
    explained = 1.0 - squares / spread if spread > 0.0 else float("nan")
    return GoodnessOfFit(explained, float(np.sqrt(squares / samples)), samples)
