"""One estimated parameter with its standard error and interval."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from scipy.special import stdtrit

NORMAL_95 = 1.959963984540054  # standard errors of the normal distribution's two-sided 95 % interval


@dataclass(frozen=True)
class ParameterEstimate:
    """One parameter: its value, standard error, 95 % interval, and whether it is valid.

    The standard error is that of coloured residuals, and of what the tolerances of aircraft and instruments add to it
    (``systematic_error``). ``white_error`` is the Cramer-Rao bound, which holds for white residuals only. ``status`` is
    "ok", or says in words why the value is not valid.
    """

    name: str
    value: float
    standard_error: float
    lower: float
    upper: float
    valid: bool
    status: str
    white_error: float
    systematic_error: float = 0.0

    @property
    def statistical_error(self) -> float:
        """The part of the standard error that noise and gusts make."""
        return math.sqrt(max(self.standard_error**2 - self.systematic_error**2, 0.0))

    def with_systematic(self, error: float, moved: float = 0.0) -> ParameterEstimate:
        """The same estimate ``moved``, its standard error and interval widened by a systematic standard ``error``."""
        arms = (math.hypot(arm, NORMAL_95 * error) for arm in (self.value - self.lower, self.upper - self.value))
        below, above = arms
        value = self.value + moved
        total, systematic = math.hypot(self.standard_error, error), math.hypot(self.systematic_error, error)
        return replace(
            self,
            value=value,
            standard_error=total,
            lower=value - below,
            upper=value + above,
            systematic_error=systematic,
        )

    def widened(self, error: float) -> ParameterEstimate:
        """The same estimate with one more statistical standard ``error`` in its standard error and interval."""
        below, above = (
            math.hypot(arm, NORMAL_95 * error) for arm in (self.value - self.lower, self.upper - self.value)
        )
        total = math.hypot(self.standard_error, error)
        return replace(self, standard_error=total, lower=self.value - below, upper=self.value + above)

    def invalid(self, status: str) -> ParameterEstimate:
        """The same estimate marked as not valid, for the reason ``status``."""
        return replace(self, valid=False, status=status)


def confidence_interval(value: float, standard_error: float, freedom: float) -> tuple[float, float]:
    """The 95 % interval, lower and upper end, of Student's t with ``freedom`` degrees of freedom."""
    half = float(stdtrit(freedom, 0.975)) * standard_error
    return value - half, value + half
