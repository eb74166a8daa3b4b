"""The aircraft file's drag as the parabola of lift that other simulators use."""

from __future__ import annotations

from typing import NamedTuple

from sysid_node.aircraft.model import Aircraft
from sysid_node.sim.model.layout import reference_flight


class ParabolicPolar(NamedTuple):
    """CD = zero + factor CL^2, equal to the file's in value and slope at the reference condition.

    ``own`` is the part of the factor that the file itself has (``CD_k``), ``fitted`` the part that stands for a slope
    with the angle of attack. Of the latter, lift by other things than the angle of attack has its share as well.
    """

    zero: float
    own: float
    fitted: float
    lift: float  # CL at the reference condition
    alpha: float  # rad, of that flight

    @property
    def factor(self) -> float:
        """CD per CL^2."""
        return self.own + self.fitted


def polar_of(aircraft: Aircraft) -> ParabolicPolar:
    """The parabola of an aircraft's derivatives; it has no fitted part where the drag does not grow with lift."""
    lift, alpha = reference_flight(aircraft)
    value = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    own, slope, offset = (value.get(f"CD_{name}", 0.0) for name in ("k", "alpha", "0"))
    return parabola(lift, alpha, offset + slope * alpha + own * lift**2, slope, value.get("CL_alpha", 0.0), own)


def parabola(lift: float, alpha: float, drag: float, slope: float, lift_slope: float, own: float) -> ParabolicPolar:
    """The parabola through a flight's CL and CD; ``slope`` is that of CD with alpha beside what ``own`` gives."""
    share = 2.0 * lift * lift_slope
    fitted = max(slope / share, -own) if slope and share > 0.0 else 0.0
    return ParabolicPolar(drag - (own + fitted) * lift**2, own, fitted, lift, alpha)
