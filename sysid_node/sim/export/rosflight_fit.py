"""Lift and drag of ROSflight's wing that give an aircraft's."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from sysid_node.sim.export.gazebo.fit import fitted_alphas, level_weights, plate_lift
from sysid_node.sim.export.steady import SteadyModel
from sysid_node.sim.importing.rosflight import EFFICIENCY, blending

Array = NDArray[np.float64]

#: What ROSflight's own files have: used where the aircraft does not stall.
_M, _ALPHA0 = 50.0, 0.4712

#: A curve of lift that bends less than this over its angles of attack is taken for a line.
_BENDS = 1e-4


@dataclass(frozen=True)
class RosflightWing:
    """Lift C_L_O + C_L_alpha alpha blended by M about alpha0 (rad) to a flat plate's, if it stalls; parasitic drag."""

    CL0: float
    CLa: float
    parasitic: float
    stalls: bool = False
    M: float = _M
    alpha0: float = _ALPHA0


def rosflight_wing(file: SteadyModel) -> RosflightWing:
    """The wing that fits best: exact for linear lift, and for what was read from such a file."""
    d, level = file.derivatives, file.level["alpha"]
    CL0, CLa, M, alpha0, stalls = d.get("CL_0", 0.0), d.get("CL_alpha", 0.0), _M, _ALPHA0, False
    if file.bent:
        alpha = fitted_alphas(file)
        lift, weight = file.curve(alpha)[:, 0], level_weights(file, alpha)
        if np.abs(weight * (CL0 + CLa * alpha - lift)).max() > _BENDS:
            M, alpha0 = _stall(alpha, lift, weight)
            CL0, CLa = _attached(alpha, lift, weight, M, alpha0)
            CL0 += float(np.interp(level, alpha, lift)) - _lift(level, CL0, CLa, M, alpha0)
            stalls = True
    geometry = file.aircraft.geometry
    induced = (CL0 + CLa * level) ** 2 / (3.14159 * EFFICIENCY * geometry.b**2 / geometry.S)
    others = sum(drag_slope(file, name) * file.level[name] for name in file.regressors if name in ("q", "de"))
    return RosflightWing(CL0, CLa, float(file.here(file)[1]) - induced - others, stalls, M, alpha0)


def drag_slope(file: SteadyModel, name: str) -> float:
    """The slope of CD over elevator or pitch rate in level flight; only the wing's lift has induced drag there."""
    d = file.derivatives
    induced = 2.0 * d.get("CD_k", 0.0) * float(file.here(file)[0]) * d.get(f"CL_{name}", 0.0)
    return d.get(f"CD_{name}", 0.0) + induced


def _lift(alpha: float, CL0: float, CLa: float, M: float, alpha0: float) -> float:
    at = np.array([alpha])
    sigma = blending(at, M, alpha0)
    return float(((1.0 - sigma) * (CL0 + CLa * at) + sigma * plate_lift(at))[0])


def _attached(alpha: Array, lift: Array, weight: Array, M: float, alpha0: float) -> tuple[float, float]:
    """Offset and slope of the attached flow by least squares."""
    sigma = blending(alpha, M, alpha0)
    columns = (weight * (1.0 - sigma))[:, None] * np.column_stack([np.ones_like(alpha), alpha])
    found = np.linalg.lstsq(columns, weight * (lift - sigma * plate_lift(alpha)), rcond=1e-10)[0]
    return float(found[0]), float(found[1])


def _stall(alpha: Array, lift: Array, weight: Array) -> tuple[float, float]:
    """Sharpness and angle (rad) of stall that leave least of the lift."""

    def left(z: Array) -> Array:
        M, alpha0 = math.exp(float(z[0])), float(z[1])
        CL0, CLa = _attached(alpha, lift, weight, M, alpha0)
        sigma = blending(alpha, M, alpha0)
        return np.asarray(weight * ((1.0 - sigma) * (CL0 + CLa * alpha) + sigma * plate_lift(alpha) - lift))

    bounds = ([math.log(5.0), 0.05], [math.log(200.0), 1.2])
    starts = [(math.log(M), a) for M in (15.0, 50.0) for a in (0.2, 0.3, 0.45)]
    fits = [least_squares(left, start, bounds=bounds, xtol=1e-13, ftol=1e-13, gtol=1e-13) for start in starts]
    best = min(fits, key=lambda fit: float(fit.cost))
    return math.exp(float(best.x[0])), float(best.x[1])
