"""Estimates as text."""

from __future__ import annotations

import math

from bench.estimation.real.dimensional import Value
from bench.estimation.real.replaying import Found


def show(value: Value | Found) -> str:
    """An estimate, its standard error in brackets; both to the error's second digit."""
    digits = 3
    if 0.0 < value.error < math.inf:
        digits = min(max(1 - math.floor(math.log10(value.error)), 0), 5)
    error = f" ({value.error:.{digits}f})" if value.error else ""
    return f"{value.value:.{digits}f}{error}"


def off(value: Value | Found, reference: Value) -> str:
    """How far from the reference, in the reference's standard errors."""
    return f"{errors_off(value, reference):+.2f}"


def errors_off(value: Value | Found, reference: Value) -> float:
    """The same as a number."""
    return (value.value - reference.value) / reference.error
