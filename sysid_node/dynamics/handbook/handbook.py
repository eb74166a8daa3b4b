"""Everything that an aircraft file says, in a handbook's terms."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.atmosphere import dynamic_pressure
from sysid_node.dynamics.handbook.equations import Equations
from sysid_node.dynamics.handbook.modes import Mode, modes
from sysid_node.dynamics.handbook.performance import Performance, TrimmedPolar, performance, polar
from sysid_node.dynamics.handbook.trim import LevelTrim, level_trim
from sysid_node.dynamics.handbook.unusual import Finding, findings
from sysid_node.dynamics.tables import full_thrust
from sysid_node.errors import InputError


@dataclass(frozen=True)
class ControlPower:
    """What one radian of a control does at the reference airspeed; NaN where the file does not tell."""

    roll_rate: float  # steady roll rate per aileron, 1/s
    pitch_acceleration: float  # per elevator, 1/s^2
    sideslip: float  # steady, straight sideslip per rudder with ailerons against the roll, 1
    sideslip_aileron: float  # aileron per rudder of that sideslip, 1


@dataclass(frozen=True)
class Handbook:
    """An aircraft file in a handbook's terms."""

    aircraft: Aircraft
    trim: LevelTrim  # at the reference airspeed
    trims: tuple[LevelTrim, ...]  # over airspeed
    slopes: Mapping[str, float]  # derivatives at that trim, tables and stall included
    static_margin: float  # share of the mean chord
    static_margin_error: float  # 1 sigma from the file's tolerances
    modes: tuple[Mode, ...]
    polar: TrimmedPolar
    performance: Performance
    power: ControlPower
    findings: tuple[Finding, ...]
    left_out: tuple[str, ...]  # effects of the file that are not part of all this


def handbook(aircraft: Aircraft) -> Handbook:
    """The handbook of an aircraft file. Raises InputError where the file has no level flight at its reference."""
    equations = Equations(aircraft)
    trim = level_trim(equations, aircraft.reference.airspeed)
    if trim is None:
        raise InputError(
            f"aircraft {aircraft.name}: no level flight at reference.airspeed {aircraft.reference.airspeed:g} m/s: "
            "lift cannot carry the weight, or no elevator angle makes Cm zero; check mass, geometry.S, CL_* and Cm_*"
        )
    slopes, found, curve = slopes_at(equations, trim), modes(equations, trim), polar(equations)
    performed = performance(equations, curve)
    margin = -slopes["Cm_alpha"] / slopes["CL_alpha"] if slopes["CL_alpha"] else math.nan
    return Handbook(
        aircraft,
        trim,
        _trims(equations, performed),
        slopes,
        margin,
        _margin_error(aircraft, slopes, margin),
        found,
        curve,
        performed,
        _power(aircraft, slopes),
        findings(aircraft, slopes, trim, margin, found),
        equations.left_out,
    )


def slopes_at(equations: Equations, trim: LevelTrim) -> dict[str, float]:
    """Every derivative by name (``Cm_alpha``) at level flight, by central differences, tables and stall included."""
    symbols = equations.aircraft.control_symbols
    at = {"V": trim.airspeed, "alpha": trim.alpha, "throttle": trim.thrust / full_thrust(equations.aircraft)}
    at |= dict.fromkeys(("beta", "p", "q", "r", *symbols), 0.0)
    elevator = equations.aircraft.controls.get("elevator")
    if elevator is not None and not math.isnan(trim.elevator):
        at[elevator.symbol] = trim.elevator
    slopes: dict[str, float] = {}
    for name in ("alpha", "beta", "p", "q", "r", *symbols):
        high, low = (equations.coefficients(**{**at, name: at[name] + side * 1e-4}) for side in (1.0, -1.0))
        pairs = zip(high._fields, high, low, strict=True)
        slopes |= {f"{c}_{name}": float(a - b) / 2e-4 for c, a, b in pairs}
    return slopes


def _trims(equations: Equations, performed: Performance) -> tuple[LevelTrim, ...]:
    """Level flight from just above the stall to 1.6 times the reference airspeed."""
    reference = equations.aircraft.reference.airspeed
    slow = performed.stall_speed if math.isfinite(performed.stall_speed) else 0.7 * reference
    speeds = np.linspace(min(1.02 * slow, 0.95 * reference), 1.6 * reference, 17)
    speeds = np.sort(np.append(speeds[np.abs(speeds - reference) > 0.02 * reference], reference))
    found = (level_trim(equations, float(speed)) for speed in speeds)
    return tuple(trim for trim in found if trim is not None)


def _margin_error(aircraft: Aircraft, slopes: Mapping[str, float], margin: float) -> float:
    """1 sigma of the static margin: tolerances of Cm_alpha and CL_alpha and of the CG's place, as independent."""
    squares = (aircraft.tolerances.get("cg_shift.x", 0.0) / aircraft.geometry.cbar) ** 2
    for name, share in (("Cm_alpha", 1.0), ("CL_alpha", margin)):
        derivative = aircraft.derivatives.get(name)
        tolerance = (derivative.tolerance or 0.0) if derivative else 0.0
        squares += (share * tolerance / slopes["CL_alpha"]) ** 2 if slopes["CL_alpha"] else math.nan
    return math.sqrt(squares)


def _power(aircraft: Aircraft, slopes: Mapping[str, float]) -> ControlPower:
    """Roll: Cl_p p b / 2V + Cl_da da = 0. Sideslip: Cl = Cn = 0. Stevens, Lewis & Johnson (2016), sec. 4.2."""
    geometry, speed = aircraft.geometry, aircraft.reference.airspeed
    symbol = {name: control.symbol for name, control in aircraft.controls.items()}
    de, da, dr = (symbol.get(name, "") for name in ("elevator", "aileron", "rudder"))

    def get(name: str) -> float:
        return slopes.get(name, math.nan)

    roll = -get(f"Cl_{da}") / get("Cl_p") * 2.0 * speed / geometry.b if get("Cl_p") else math.nan
    load = dynamic_pressure(aircraft.reference.air_density, speed) * geometry.S
    pitch = load * geometry.cbar * get(f"Cm_{de}") / aircraft.inertia.Iyy
    matrix = np.array([[get("Cl_beta"), get(f"Cl_{da}")], [get("Cn_beta"), get(f"Cn_{da}")]])
    right = -np.array([get(f"Cl_{dr}"), get(f"Cn_{dr}")])
    solvable = np.isfinite(matrix).all() and np.isfinite(right).all() and abs(np.linalg.det(matrix)) > 1e-9
    sideslip, aileron = np.linalg.solve(matrix, right).tolist() if solvable else (math.nan, math.nan)
    return ControlPower(roll, pitch, sideslip, aileron)
