"""Steady, straight flight: alpha, elevator and thrust."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure
from sysid_node.dynamics.forces import thrust_line
from sysid_node.dynamics.handbook.equations import Array, Equations
from sysid_node.dynamics.tables import full_thrust


@dataclass(frozen=True)
class LevelTrim:
    """Level flight at one airspeed (m/s); ``elevator`` is NaN where the file has none that pitches."""

    airspeed: float
    alpha: float  # rad
    elevator: float  # rad
    thrust: float  # N; negative where the file's drag is
    lift: float  # CL
    drag: float  # CD


def level_trim(equations: Equations, airspeed: float) -> LevelTrim | None:
    """Steady, level flight at an airspeed (m/s), or None where there is none: the forces or Cm do not balance."""
    aircraft, symbol = equations.aircraft, pitch_control(equations)
    inclination, arm = thrust_line(aircraft.throttle)
    area = dynamic_pressure(equations.density, airspeed) * aircraft.geometry.S
    weight = aircraft.mass * GRAVITY

    def unbalanced(x: Array) -> list[float]:
        alpha, elevator, thrust = x[0], x[1], x[2] * weight
        throttle = thrust / full_thrust(aircraft)
        c = equations.coefficients(V=airspeed, alpha=alpha, throttle=throttle, **({symbol: elevator} if symbol else {}))
        along = (thrust * np.cos(alpha + inclination) - area * c.CD) / weight
        up = (thrust * np.sin(alpha + inclination) + area * c.CL) / weight - 1.0
        pitch = c.Cm + thrust * arm / (area * aircraft.geometry.cbar) if symbol else elevator
        return [float(along), float(up), float(pitch)]

    found = root(unbalanced, np.array([0.05, 0.0, 0.1]), tol=1e-10)
    if not found.success or abs(found.x[0]) > 1.0 or np.abs(found.fun).max() > 1e-6:
        return None
    alpha, elevator, thrust = (float(value) for value in found.x)
    throttle = thrust * weight / full_thrust(aircraft)
    c = equations.coefficients(V=airspeed, alpha=alpha, throttle=throttle, **({symbol: elevator} if symbol else {}))
    trimmed = elevator if symbol else float("nan")
    return LevelTrim(airspeed, alpha, trimmed, thrust * weight, float(c.CL), float(c.CD))


def pitch_control(equations: Equations) -> str:
    """The symbol of the elevator where it pitches, else ``""``."""
    elevator = equations.aircraft.controls.get("elevator")
    if elevator is None:
        return ""
    symbol = elevator.symbol
    step = equations.coefficients(**{symbol: 0.05}).Cm - equations.coefficients(**{symbol: -0.05}).Cm
    return symbol if abs(step) > 1e-6 else ""


def trimmed_polar(equations: Equations, alpha: Array) -> tuple[Array, Array, Array]:
    """Elevator (rad), CL and CD (N,) over angles of attack (N,), with the elevator that makes Cm zero at each.

    The thrust's moment is left out. Where there is no elevator that pitches, it is zero. The elevator is kept within
    its limit.
    """
    symbol = pitch_control(equations)
    elevator = np.zeros_like(alpha)
    if symbol:
        limit = equations.aircraft.controls["elevator"].limit or 0.6
        for _ in range(30):  # Newton's method; linear derivatives need one step
            here = equations.coefficients(alpha=alpha, **{symbol: elevator}).Cm
            slope = (equations.coefficients(alpha=alpha, **{symbol: elevator + 1e-4}).Cm - here) / 1e-4
            step = np.where(np.abs(slope) > 1e-6, -here / np.where(slope == 0.0, 1.0, slope), 0.0)
            moved = np.clip(elevator + step, -limit, limit)
            done = np.allclose(moved, elevator, atol=1e-10)
            elevator = moved
            if done:
                break
    c = equations.coefficients(alpha=alpha, **({symbol: elevator} if symbol else {}))
    return elevator, np.asarray(c.CL + 0.0 * alpha), np.asarray(c.CD + 0.0 * alpha)
