"""Stall speed, best glide and climb, from the polar of trimmed flight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure
from sysid_node.dynamics.handbook.equations import Array, Equations
from sysid_node.dynamics.handbook.trim import trimmed_polar

#: Angles of attack (rad) of a file that has neither a stall nor a table over alpha: an assumption, and said so.
ASSUMED_ALPHA = (math.radians(-5.0), math.radians(15.0))


@dataclass(frozen=True)
class TrimmedPolar:
    """Trimmed lift and drag over the angle of attack (N,), and where the range of angles is from."""

    alpha: Array  # rad
    elevator: Array  # rad
    lift: Array
    drag: Array
    range_from: str


@dataclass(frozen=True)
class Performance:
    """Speeds (m/s, at the reference air density) and what belongs to them; NaN where the file does not tell."""

    stall_speed: float
    largest_lift: float
    stall_alpha: float  # rad
    stall_from: str
    glide_speed: float
    glide_ratio: float
    glide_note: str
    climb_rate: float  # m/s
    climb_speed: float


def polar(equations: Equations) -> TrimmedPolar:
    """The trimmed polar over the angles of attack for which the file holds."""
    low, high, source = _alpha_range(equations)
    alpha = np.linspace(low, high, 161)
    return TrimmedPolar(alpha, *trimmed_polar(equations, alpha), source)


def performance(equations: Equations, curve: TrimmedPolar) -> Performance:
    """Stall, best glide and climb."""
    best = int(np.argmax(curve.lift))
    largest = float(curve.lift[best])
    inside = 0 < best < curve.alpha.size - 1
    stall_from = (
        f"largest trimmed lift, {curve.range_from}"
        if inside
        else f"no stall in the file: lift at the end of the range of angles, {curve.range_from}"
    )
    speed = _speed_of(equations, largest)
    glide = _best_glide(equations, curve)
    return Performance(
        speed, largest, float(curve.alpha[best]), stall_from, *glide, *_best_climb(equations, curve, best)
    )


def _alpha_range(equations: Equations) -> tuple[float, float, str]:
    aircraft = equations.aircraft
    if equations.stall["depth"] > 0.0:
        star = equations.stall["alpha_star"]
        return ASSUMED_ALPHA[0], star + 0.15, "by the file's stall_separation"
    over = [t.points[t.over.index("alpha")] for t in aircraft.tables if "alpha" in t.over and t.coefficient == "CL"]
    if over:
        low, high = max(p[0] for p in over), min(p[-1] for p in over)
        if high > low:
            return max(low, -0.35), min(high, 0.8), "by the file's tables over alpha"
    return *ASSUMED_ALPHA, "assumed as -5 to 15 deg"


def _speed_of(equations: Equations, lift: float) -> float:
    """The airspeed (m/s) at which this CL carries the weight."""
    aircraft = equations.aircraft
    if lift <= 0.0:
        return math.nan
    return math.sqrt(2.0 * aircraft.mass * GRAVITY / (equations.density * aircraft.geometry.S * lift))


def _best_glide(equations: Equations, curve: TrimmedPolar) -> tuple[float, float, str]:
    """Airspeed (m/s), lift over drag, and a remark."""
    usable = (curve.drag > 0.0) & (curve.lift > 0.0)
    if not usable.any():
        return math.nan, math.nan, "the file's drag is not above zero where the lift is"
    ratio = np.where(usable, curve.lift / np.where(usable, curve.drag, 1.0), -np.inf)
    best = int(np.argmax(ratio))
    notes = [] if 0 < best < curve.alpha.size - 1 else ["at the end of the range of angles"]
    if not (curve.drag > 0.0).all():
        notes.append("the file's drag is below zero at some angles")
    if any({"V", "Mach"} & {*table.over} for table in equations.aircraft.tables):
        notes.append("tables over airspeed are taken at the reference; those of an imported file may hold thrust")
    curved = "CD_k" in equations.aircraft.derivatives or any(t.coefficient == "CD" for t in equations.aircraft.tables)
    if not curved:
        notes.append("the file's drag is linear in alpha, so it holds near the reference alone")
    return _speed_of(equations, float(curve.lift[best])), float(ratio[best]), "; ".join(notes)


def _best_climb(equations: Equations, curve: TrimmedPolar, stall: int) -> tuple[float, float]:
    """Largest rate of climb (m/s) and its airspeed, with the file's full thrust at every airspeed."""
    aircraft = equations.aircraft
    thrust = aircraft.throttle.max_thrust if aircraft.throttle else None
    usable = (curve.lift > 0.02) & (np.arange(curve.lift.size) <= stall)
    if thrust is None or not usable.any():
        return math.nan, math.nan
    weight = aircraft.mass * GRAVITY
    speed = np.sqrt(2.0 * weight / (equations.density * aircraft.geometry.S * curve.lift[usable]))
    at = {"alpha": curve.alpha[usable], "V": speed}
    full = equations.coefficients(**at, throttle=1.0).CD - equations.coefficients(**at).CD  # tables over the throttle
    drag = dynamic_pressure(equations.density, speed) * aircraft.geometry.S * (curve.drag[usable] + full)
    near = speed <= 2.0 * aircraft.reference.airspeed
    climb = np.where(near, speed * np.clip((thrust - drag) / weight, -1.0, 1.0), -np.inf)
    best = int(np.argmax(climb))
    return (float(climb[best]), float(speed[best])) if near.any() else (math.nan, math.nan)
