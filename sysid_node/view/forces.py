"""Forces and moments that a model does not explain, as arrows at the aircraft."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sysid_node.aircraft.model import Geometry
from sysid_node.dynamics.atmosphere import dynamic_pressure
from sysid_node.flight.record import Array
from sysid_node.view.scene import PURPLE, VERMILION, Arrow, Colour

#: Length of the longest arrow, in spans.
_LONGEST = 0.6


def missing_arrows(
    time: Array,
    coefficients: Mapping[str, Array],
    flow: tuple[Array, Array, Array],
    geometry: Geometry,
    names: tuple[str, str] = ("missing force", "missing moment"),
    colours: tuple[Colour, Colour] = (VERMILION, PURPLE),
) -> list[Arrow]:
    """The force (N) and the moment (N m) of coefficients (N,), measured minus modelled, at times (N,) s.

    CL and CD are along stability axes, the others along body axes; ``flow`` is airspeed m/s, angle of attack rad and
    air density kg/m^3, each (N,). A coefficient that is missing counts as zero.
    """
    airspeed, alpha, density = flow
    pressure = np.asarray(dynamic_pressure(density, airspeed)) * geometry.S
    zero = np.zeros_like(time)
    lift, drag, side, roll, pitch, yaw = (coefficients.get(c, zero) for c in ("CL", "CD", "CY", "Cl", "Cm", "Cn"))
    cosine, sine = np.cos(alpha), np.sin(alpha)
    force = pressure[:, None] * np.column_stack([lift * sine - drag * cosine, side, -lift * cosine - drag * sine])
    moment = pressure[:, None] * np.column_stack([roll * geometry.b, pitch * geometry.cbar, yaw * geometry.b])
    pairs = zip(names, ("N", "N m"), (force, moment), colours, strict=True)
    return [Arrow(n, unit, time, v, colour, arrow_scale(v, geometry.b)) for n, unit, v, colour in pairs]


def arrow_scale(vectors: Array, span: float) -> float:
    """Metres of arrow per unit, for which the largest but the rarest of vectors (N, 3) are as long as shown best.

    One where they are all zero, or too large for any scale.
    """
    size = np.linalg.norm(np.nan_to_num(vectors), axis=1)
    large = float(np.percentile(size, 99.0)) if size.size else 0.0
    scale = _LONGEST * span / large if large > 0.0 else 1.0
    return scale if 0.0 < scale < np.inf else 1.0
