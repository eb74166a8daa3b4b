"""What a batch estimator returns: estimates with honest intervals, and how well the model answers the flight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from sysid_node.flight.record import Array


@dataclass(frozen=True)
class Estimate:
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
class Quality:
    """How well one output or coefficient is answered: R^2, and the standard deviation of the residual in its unit."""

    r_squared: float
    residual_std: float


@dataclass(frozen=True)
class Answer:
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


@dataclass(frozen=True)
class Fit:
    """The outcome of one estimation.

    ``covariance`` (P, P) of the parameters in the order of ``estimates``, for coloured residuals. ``noise`` is the
    residuals' standard deviation by output; ``log_det`` = ln det R, what maximum likelihood minimises (of equation
    error: of the equations' residual variances). ``nuisance`` holds what was estimated besides for each manoeuvre
    (initial states, biases). ``converged`` and ``message`` say plainly how it ended; ``remarks`` are sentences for
    the reader: what cannot be told apart, what lies at a bound, what was left out.
    """

    method: str
    estimates: Mapping[str, Estimate]
    covariance: Array
    noise: Mapping[str, float]
    log_det: float
    answers: Sequence[Answer]
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
        return correlation(self.covariance)

    @property
    def quality(self) -> dict[str, Quality]:
        """R^2 and residual by output, over all manoeuvres together."""
        names = self.answers[0].names
        return {name: _quality(self.answers, column) for column, name in enumerate(names)}


def correlation(covariance: Array) -> Array:
    """Correlation matrix of a covariance; zero where a variance is zero."""
    deviation = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    with np.errstate(divide="ignore", invalid="ignore"):
        scaled = covariance / np.outer(deviation, deviation)
    result = np.where(np.isfinite(scaled), scaled, 0.0)
    np.fill_diagonal(result, 1.0)
    return result


def interval(value: float, standard_error: float, freedom: float) -> tuple[float, float]:
    """95 % interval with Student's t for the degrees of freedom of the residuals' spectrum."""
    half = float(stats.t.ppf(0.975, freedom)) * standard_error
    return value - half, value + half


def _quality(answers: Sequence[Answer], column: int) -> Quality:
    measured = np.concatenate([answer.measured[:, column] for answer in answers])
    residual = np.concatenate([answer.residuals[:, column] for answer in answers])
    kept = np.isfinite(residual)
    if kept.sum() < 2:
        return Quality(float("nan"), float("nan"))
    spread = float(np.sum((measured[kept] - measured[kept].mean()) ** 2))
    squares = float(np.sum(residual[kept] ** 2))
    return Quality(1.0 - squares / spread if spread > 0.0 else float("nan"), float(np.sqrt(squares / kept.sum())))
