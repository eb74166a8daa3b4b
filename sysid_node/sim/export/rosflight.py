"""The aircraft as parameters of ROSflight's fixed-wing simulation (rosflight_sim, node fixedwing_forces_and_moments).

Its surfaces run from -1 to 1, positive aileron rolling right, so control derivatives are per full deflection. Drag is
C_D_p + (C_L_O + C_L_alpha alpha)^2 / (0.9 pi AR): C_D_p is chosen to give the file's drag at the reference condition.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.sim.export.cells import finite, plain
from sysid_node.sim.export.polar import polar_of

_NAMES = {"CL": "C_L", "CD": "C_D", "CY": "C_Y", "Cl": "C_ell", "Cm": "C_m", "Cn": "C_n"}

#: ROSflight's symbol and sign of each control.
_CONTROLS = {"de": ("e", 1.0), "da": ("a", -1.0), "dr": ("r", 1.0)}

_HEADER = """\
# {name}: aerodynamics for rosflight_sim, written by sysid export.
# Surfaces run from -1 to 1 there: control derivatives hold for full deflection ({limits}).
# Propeller, motor and servo parameters are not in an aircraft file: keep your own (D_prop, CT_*, CQ_*, KV, ...).
# The mass (kg) and inertia (kg m^2) of the vehicle's URDF:
# mass: {mass:.9g}
# Jx: {inertia.Ixx:.9g}
# Jy: {inertia.Iyy:.9g}
# Jz: {inertia.Izz:.9g}
# Jxz: {inertia.Ixz:.9g}
"""


def rosflight_parameters(aircraft: Aircraft, effects: Mapping[str, Mapping[str, float]] | None = None) -> str:
    """The YAML. Raises InputError for any effect, and for controls that ROSflight does not have."""
    if effects:
        raise InputError(f"effect {next(iter(effects))!r} cannot be exported to rosflight: it has derivatives only")
    unsupported = [name for name, control in aircraft.controls.items() if control.symbol not in _CONTROLS]
    if unsupported:
        raise InputError(f"control {unsupported[0]!r}: rosflight_sim knows elevator, aileron and rudder only")
    travel = {control.symbol: control.limit or 1.0 for control in aircraft.controls.values()}
    limits = ", ".join(f"{control.symbol} {travel[control.symbol]:g} rad" for control in aircraft.controls.values())
    lines = [_HEADER.format(name=plain(aircraft.name), limits=limits, mass=aircraft.mass, inertia=aircraft.inertia)]
    lines += ["/**:", "  ros__parameters:"]
    lines += [f"    {name}: {_number(value)}" for name, value in _parameters(aircraft, travel).items()]
    return "\n".join(lines) + "\n"


def _parameters(aircraft: Aircraft, travel: Mapping[str, float]) -> dict[str, float]:
    value = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    geometry = aircraft.geometry
    parameters = {
        "rho": aircraft.reference.air_density,
        "mass": aircraft.mass,
        "wing_s": geometry.S,
        "wing_b": geometry.b,
        "wing_c": geometry.cbar,
        "wing_M": 50.0,
        "wing_epsilon": 0.9,
        "wing_alpha0": 0.4712,
    }
    for coefficient, name in _NAMES.items():
        parameters[f"{name}_O"] = value.get(f"{coefficient}_0", 0.0)
        for regressor in ("alpha", "beta", "p", "q", "r"):
            parameters[f"{name}_{regressor}"] = value.get(f"{coefficient}_{regressor}", 0.0)
        for symbol, (letter, sign) in _CONTROLS.items():
            per_radian = value.get(f"{coefficient}_{symbol}", 0.0)
            parameters[f"{name}_delta_{letter}"] = sign * travel.get(symbol, 0.0) * per_radian
    parameters["C_D_p"] = _parasitic(aircraft, value)
    return parameters


def _parasitic(aircraft: Aircraft, value: Mapping[str, float]) -> float:
    """ROSflight's C_D_p: the file's drag at the reference condition minus ROSflight's induced drag."""
    polar, geometry = polar_of(aircraft), aircraft.geometry
    wing = value.get("CL_0", 0.0) + value.get("CL_alpha", 0.0) * polar.alpha
    induced = wing**2 / (math.pi * 0.9 * geometry.b**2 / geometry.S)
    return polar.zero + polar.factor * polar.lift**2 - induced


def _number(value: float) -> str:
    """A YAML float; ROS would take 1 for an integer and refuse it."""
    text = f"{finite(value):.9g}"
    return text if any(mark in text for mark in ".en") else f"{text}.0"
