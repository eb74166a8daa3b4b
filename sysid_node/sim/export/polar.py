"""The aircraft file's drag as the parabola of lift that other simulators use."""

from __future__ import annotations

from typing import NamedTuple

from sysid_node.aircraft.model import Aircraft
from sysid_node.sim.model.layout import reference_flight


class ParabolicPolar(NamedTuple):
    """CD = zero + factor CL^2, equal to the file's in value and slope at the reference condition."""

    zero: float
    factor: float
    lift: float  # CL at the reference condition
    alpha: float  # rad, of that flight


def polar_of(aircraft: Aircraft) -> ParabolicPolar:
    """The parabola; its factor is 0 where the file's drag does not grow with lift."""
    lift, alpha = reference_flight(aircraft)
    value = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    get = value.get
    if "CD_alpha" not in value:
        return ParabolicPolar(get("CD_0", 0.0), get("CD_k", 0.0), lift, alpha)
    slope = get("CL_alpha", 0.0) * lift
    factor = max(value["CD_alpha"] / (2.0 * slope), 0.0) if slope > 0.0 else 0.0
    drag = get("CD_0", 0.0) + value["CD_alpha"] * alpha + get("CD_k", 0.0) * lift**2
    return ParabolicPolar(drag - factor * lift**2, factor, lift, alpha)
