"""What the aircraft file says of its derivatives before a flight."""

from __future__ import annotations

from sysid_node.aircraft.model import Aircraft

#: Tolerance of a derivative without one in the aircraft file: this share of its value, and at least this much (chosen).
_DEFAULT_TOLERANCE = (0.5, 0.05)


def tolerance_of(aircraft: Aircraft, name: str) -> float:
    """The tolerance (1 sigma) of a derivative in the aircraft file, or a default that follows from its value."""
    derivative = aircraft.derivatives[name]
    return derivative.tolerance or max(_DEFAULT_TOLERANCE[0] * abs(derivative.value), _DEFAULT_TOLERANCE[1])
