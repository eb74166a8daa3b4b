"""One estimated parameter with its standard error and interval."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scipy import stats


@dataclass(frozen=True)
class ParameterEstimate:
    """One parameter: its value, standard error for coloured residuals, 95 % interval, and whether it is valid.

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

    def invalid(self, status: str) -> ParameterEstimate:
        """The same estimate marked as not valid, for the reason ``status``."""
        return replace(self, valid=False, status=status)


def confidence_interval(value: float, standard_error: float, freedom: float) -> tuple[float, float]:
    """The 95 % interval, lower and upper end, of Student's t with ``freedom`` degrees of freedom."""
    half = float(stats.t.ppf(0.975, freedom)) * standard_error
    return value - half, value + half
