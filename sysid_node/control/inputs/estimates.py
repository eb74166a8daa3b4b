"""Published estimates in the form that the controller uses."""

from __future__ import annotations

from sysid_node.control.types import IdentifiedDerivative
from sysid_node.online.types import Estimates


def identified_derivatives(estimates: Estimates) -> dict[str, IdentifiedDerivative]:
    """By derivative: value, 95 % interval, validity, and R^2 of its coefficient's equation (0 where it is unknown)."""
    r_squared = {name: fit.r_squared for name, fit in estimates.fits.items()}
    return {
        d.name: IdentifiedDerivative(d.value, d.lower, d.upper, d.valid, r_squared.get(d.name.partition("_")[0], 0.0))
        for d in estimates.derivatives.values()
    }
