"""The numbers of Gazebo's AdvancedLiftDrag that give an aircraft's coefficients.

The plugin's drag is a parabola of its lift by angle of attack, sideslip and surfaces; near ``alpha_stall`` lift and
drag blend to a flat plate's, and the pitching moment has another slope beyond it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from sysid_node.sim.export.polar import ParabolicPolar, parabola, polar_of
from sysid_node.sim.export.steady import SteadyModel
from sysid_node.sim.importing.gazebo.advanced_lift_drag import blending, flat_plate_drag

Array = NDArray[np.float64]

#: The plugin's own value: in ordinary flight it does not stall.
NO_STALL = math.pi / 2.0

#: The angles of attack (rad) over which a curve is fitted, where no table says what the file knows.
_KNOWN = (-0.25, 0.4)
_WIDEST = (-0.35, 0.6)

#: A pitching moment that bends more than this is taken for one of a plugin at another place.
_TURNS = 1e-4


@dataclass(frozen=True)
class GazeboNumbers:
    """The plugin's numbers over the angle of attack: offsets and slopes (per rad), drag CD0 + factor CL^2."""

    CL0: float
    CLa: float
    Cem0: float
    Cema: float
    CD0: float
    factor: float
    fitted: float  # the part of the factor whose share in the slopes over surfaces and sideslip is to be taken off
    lift: float  # CL in level flight
    alpha_stall: float = NO_STALL
    Cema_stall: float = 0.0
    cp: tuple[float, float] = (0.0, 0.0)  # the plugin's place forward of and below the file's centre of gravity, m


def gazebo_numbers(file: SteadyModel) -> GazeboNumbers:
    """The numbers that fit best: exact for derivatives with a polar, and for what was read from such a plugin."""
    d = file.derivatives
    if not file.bent:
        polar = _polar(file)
        zero = polar.zero if polar.factor > 0.0 else polar.zero + polar.factor * polar.lift**2
        factor = max(polar.factor, 0.0)
        return GazeboNumbers(
            d.get("CL_0", 0.0), d.get("CL_alpha", 0.0), d.get("Cm_0", 0.0), d.get("Cm_alpha", 0.0),
            zero, factor, min(polar.fitted, factor), polar.lift,
        )  # fmt: skip
    return _stalled(file)


def _polar(file: SteadyModel) -> ParabolicPolar:
    if file.plain:
        polar = polar_of(file.aircraft)
        added = file.derivatives["CD_0"] - _value(file, "CD_0")  # what the drag has by airspeed
        # the elevator's slope has lost the part that the parabola has; in level flight it is given back here
        added += 2.0 * polar.fitted * polar.lift * file.derivatives.get("CL_de", 0.0) * file.level.get("de", 0.0)
        return ParabolicPolar(polar.zero + added, polar.own, polar.fitted, polar.lift, polar.alpha)
    d = file.derivatives
    lift, drag = file.here(file)[:2]
    return parabola(float(lift), file.level["alpha"], float(drag), d["CD_alpha"], d["CL_alpha"], 0.0)


def _value(file: SteadyModel, name: str) -> float:
    known = file.aircraft.derivatives.get(name)
    return known.value if known is not None else 0.0


def _stalled(file: SteadyModel) -> GazeboNumbers:
    """A fit by least squares over the angle of attack; near level flight it counts most."""
    alpha = fitted_alphas(file)
    curve = file.curve(alpha)
    weight = level_weights(file, alpha)
    lift = curve[:, 0]
    stall = best_stall(partial(_lift_left, alpha, lift, weight))
    CL0, CLa = _lift_fit(alpha, lift, weight, stall)
    sigma = blending(alpha, stall)
    others = sum(file.derivatives.get(f"CL_{n}", 0.0) * file.level[n] for n in file.regressors if n != "alpha")
    whole = (1.0 - sigma) * (CL0 + CLa * alpha) + sigma * plate_lift(alpha) + others
    here = float(np.interp(file.level["alpha"], alpha, whole))
    geometry = file.aircraft.geometry
    base = sigma * flat_plate_drag(alpha, geometry.b**2 / geometry.S)
    # of the surfaces' slopes the part that the parabola has is taken off them; in level flight it is given back here
    columns = np.column_stack([1.0 - sigma, (1.0 - sigma) * whole**2 - 2.0 * here * others])
    CD0, factor = _solve(columns, curve[:, 1] - base, weight)
    if factor < 0.0:
        (CD0,), factor = _solve(columns[:, :1], curve[:, 1] - base, weight), 0.0
    moment, cp = _moment(file, alpha, weight, stall)
    return GazeboNumbers(CL0, CLa, moment[0], moment[1], CD0, factor, factor, here, stall, moment[2], cp)


def _moment(file: SteadyModel, alpha: Array, weight: Array, stall: float) -> tuple[list[float], tuple[float, float]]:
    """Cem0, Cema and Cema_stall, and the plugin's place (m) where this alone makes the pitching moment that of the
    file: the moment then turns at stall as the lift does."""
    attached = np.clip(alpha, -stall, stall)
    own = np.column_stack([np.ones_like(alpha), attached, alpha - attached])
    target = file.curve(alpha)[:, 4]
    found = _solve(own, target, weight)
    left = float(np.abs(weight * (own @ found - target)).max())
    lift, drag = file(file.states(alpha=alpha))[:, :2].T
    sin, cos = np.sin(alpha), np.cos(alpha)
    geometry = file.aircraft.geometry
    places = np.column_stack([lift * cos + drag * sin, lift * sin - drag * cos]) / geometry.cbar
    both = np.column_stack([own, places])
    better = _solve(both, target, weight)
    still = float(np.abs(weight * (both @ better - target)).max())
    if left > _TURNS and still < 0.1 * left and max(map(abs, better[3:])) < 0.25 * geometry.b:
        return better[:3], (better[3], better[4])
    return found, (0.0, 0.0)


def fitted_alphas(file: SteadyModel) -> Array:
    """The angles of attack (N,), rad, over which the file's curves are known."""
    points = [x for t in file.aircraft.tables for name, axis in zip(t.over, t.points, strict=True) if name == "alpha"
              for x in axis]  # fmt: skip
    low, high = (min(points), max(points)) if points else _KNOWN
    low, high = max(min(low, file.level["alpha"] - 0.1), _WIDEST[0]), min(max(high, _KNOWN[1]), _WIDEST[1])
    inside = [x for x in points if low <= x <= high]
    if len(set(inside)) > 20:
        return np.unique(inside)  # between the points the file is linear, and what it was read from is not
    return np.linspace(low, high, 161)


def level_weights(file: SteadyModel, alpha: Array) -> Array:
    """Weights (N,) of the fit: one in level flight, a half 0.1 rad from it."""
    return np.asarray(1.0 / (1.0 + ((alpha - file.level["alpha"]) / 0.1) ** 2))


def best_stall(left: partial[float]) -> float:
    """The angle of stall (rad) that leaves least of the lift."""
    tried = [*np.linspace(0.1, 0.8, 71).tolist(), NO_STALL]
    sizes = [left(x) for x in tried]
    best = int(np.argmin(sizes))
    if best == len(tried) - 1:
        return NO_STALL
    bounds = (tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 2)])
    found = minimize_scalar(left, bounds=bounds, method="bounded", options={"xatol": 1e-12})
    return float(found.x) if found.fun < sizes[best] else tried[best]


def plate_lift(alpha: Array) -> Array:
    """Lift of a flat plate (Beard & McLain, 2012, eq. 4.9)."""
    return np.asarray(2.0 * np.sign(alpha) * np.sin(alpha) ** 2 * np.cos(alpha))


def _lift_fit(alpha: Array, lift: Array, weight: Array, stall: float) -> tuple[float, float]:
    sigma = blending(alpha, stall)
    columns = np.column_stack([1.0 - sigma, (1.0 - sigma) * alpha])
    CL0, CLa = _solve(columns, lift - sigma * plate_lift(alpha), weight)
    return CL0, CLa


def _lift_left(alpha: Array, lift: Array, weight: Array, stall: float) -> float:
    CL0, CLa = _lift_fit(alpha, lift, weight, stall)
    sigma = blending(alpha, stall)
    rest = (1.0 - sigma) * (CL0 + CLa * alpha) + sigma * plate_lift(alpha) - lift
    return float((weight * rest) @ (weight * rest))


def _solve(columns: Array, target: Array, weight: Array) -> list[float]:
    return [float(x) for x in np.linalg.lstsq(weight[:, None] * columns, weight * target, rcond=1e-10)[0]]
