"""The aircraft as parameters of ROSflight's fixed-wing simulation (rosflight_sim, node fixedwing_forces_and_moments).

Its equations are those of Beard & McLain (2012), "Small Unmanned Aircraft", ch. 4; positive aileron rolls right. Drag
is C_D_p + (C_L_O + C_L_alpha alpha)^2 / (0.9 pi AR), and C_D_p is chosen to give the file's drag in level flight.

Versions that know ``max_elevator_deflection_angle`` take deflections in rad and have linear lift; older ones take
deflections from -1 to 1 and blend to a flat plate at stall. An aircraft that stalls is written for the latter.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.sim.export.cells import finite, plain
from sysid_node.sim.export.exported import Exported
from sysid_node.sim.export.folding import FOLDED, Effects, folded, thrust_factor
from sysid_node.sim.export.losses import differences, late_failures, not_held
from sysid_node.sim.export.rosflight_fit import RosflightWing, drag_slope, rosflight_wing
from sysid_node.sim.export.servos import first_order_lags, second_order_line
from sysid_node.sim.export.steady import Coefficients, Columns, SteadyModel
from sysid_node.sim.importing.plant import PlantStates, nondimensional
from sysid_node.sim.importing.rosflight import NO_SERVO_LAG, rosflight_loads

Array = NDArray[np.float64]

NAMES = {"CL": "C_L", "CD": "C_D", "CY": "C_Y", "Cl": "C_ell", "Cm": "C_m", "Cn": "C_n"}

#: ROSflight's symbol and sign of each control.
CONTROLS = {"de": ("e", 1.0), "da": ("a", -1.0), "dr": ("r", 1.0)}
_ANGLES = {"de": "max_elevator_deflection_angle", "da": "max_aileron_deflection_angle",
           "dr": "max_rudder_deflection_angle"}  # fmt: skip

_HEADER = """\
# {name}: parameters of rosflight_sim's fixed wing, written by sysid export.
# {convention}
# Motor and propeller stand for a thrust in proportion to the throttle at every airspeed, as the aircraft file has it.
# The mass (kg) and inertia (kg m^2) of the vehicle's URDF:
# mass: {mass:.12g}
# Jx: {inertia.Ixx:.12g}
# Jy: {inertia.Iyy:.12g}
# Jz: {inertia.Izz:.12g}
# Jxz: {inertia.Ixz:.12g}
"""

_RADIANS = "Control derivatives are per rad, for versions of rosflight_sim that know max_elevator_deflection_angle."
_SHARES = (
    "For versions of rosflight_sim that blend at stall: surfaces run from -1 to 1 there, and control derivatives hold "
    "for full deflection ({limits})."
)

_STALL = (
    "stall: only versions of rosflight_sim that take deflections from -1 to 1 blend at stall; newer ones, which know "
    "max_elevator_deflection_angle, would misread this file"
)

_AIRSPEED = (
    " (where it is how your propeller's thrust changes with airspeed: keep your own motor, propeller and C_ell_O)"
)

#: Diameter (m) and speed at full throttle (rad/s) of the propeller that stands for the thrust: any values do.
_DIAMETER, _FULL_SPEED = 0.3, 1000.0

#: Torque for each newton of thrust where the aircraft has none, m; and the motor's constant without back-EMF, V s/rad.
_NO_TORQUE, _KQ = 1e-9, 1e-12

HELD = (
    "actuator_lag", "actuator_bias", "stuck_surface", "control_effectiveness_loss", "cg_shift", "thrust_scale",
    "thrust_yaw", "lateral_asymmetry", "lateral_alpha_coupling", "drag_rise", "control_nonlinearity",
    "nonlinear_pitching_moment", "propwash",
)  # fmt: skip

WHY = {
    "command_delay": "rosflight_sim has no delay of commands",
    "actuator_rate_limit": "rosflight_sim's servos have none",
    "actuator_backlash": "rosflight_sim's servos have no free play",
    "motor_lag": "rosflight_sim's motor follows at once",
    "unsteady_aerodynamics": "rosflight_sim has no terms in the rate of alpha",
    "stall_separation": "its memory (tau1, tau2); of its steady curve what wing_M and wing_alpha0 give",
    "ground_effect": "rosflight_sim has none",
    "structural_mode": "rosflight_sim's aircraft is rigid",
    "thrust_line_offset": "the aircraft has no throttle",
}


def rosflight_parameters(aircraft: Aircraft, effects: Effects | None = None) -> Exported:
    """The YAML, and what it does not hold. Raises InputError for controls that ROSflight does not have."""
    unsupported = [name for name, control in aircraft.controls.items() if control.symbol not in CONTROLS]
    if unsupported:
        raise InputError(f"control {unsupported[0]!r}: rosflight_sim knows elevator, aileron and rudder only")
    aircraft, rest = folded(aircraft, effects or {})
    file = SteadyModel(aircraft, rest)
    form = _Form(file, rosflight_wing(file))
    text = _text(form, rest)
    lines = [*servo_lines(aircraft, rest), *thrust_lines(aircraft, rest), *not_held(rest, HELD, WHY)]
    lines += late_failures(rest)
    lines += [line + _AIRSPEED * line.startswith("V from") for line in differences(file, _read_back(text, form))]
    if form.wing.stalls:
        lines.insert(0, _STALL)
    return Exported(text, tuple(lines), frozenset((*HELD, *FOLDED, "stall_separation")))


@dataclass(frozen=True)
class _Form:
    """The aircraft in steady flight, its wing as ROSflight has it, and by it the unit of deflections."""

    file: SteadyModel
    wing: RosflightWing

    @property
    def units(self) -> dict[str, float]:
        """By symbol the rad of a deflection of 1."""
        if not self.wing.stalls:
            return dict.fromkeys(self.file.aircraft.control_symbols, 1.0)
        return {c.symbol: c.limit or 1.0 for c in self.file.aircraft.controls.values()}


def _text(form: _Form, rest: Effects) -> str:
    aircraft = form.file.aircraft
    limits = ", ".join(f"{symbol} {unit:g} rad" for symbol, unit in form.units.items())
    convention = _SHARES.format(limits=limits) if form.wing.stalls else _RADIANS
    lines = [_HEADER.format(name=plain(aircraft.name), convention=convention, mass=finite(aircraft.mass),
                            inertia=aircraft.inertia)]  # fmt: skip
    lines += ["/**:", "  ros__parameters:"]
    parameters = _airframe(form) | _servo(aircraft, rest) | _motor(aircraft, rest)
    lines += [f"    {name}: {number_text(value)}" for name, value in parameters.items()]
    return "\n".join(lines) + "\n"


def _airframe(form: _Form) -> dict[str, float]:
    aircraft, d, wing = form.file.aircraft, form.file.derivatives, form.wing
    geometry = aircraft.geometry
    parameters = {
        "rho": aircraft.reference.air_density,
        "mass": aircraft.mass,
        "Jxx": aircraft.inertia.Ixx,
        "Jyy": aircraft.inertia.Iyy,
        "Jzz": aircraft.inertia.Izz,
        "Jxz": aircraft.inertia.Ixz,
        "wing_s": geometry.S,
        "wing_b": geometry.b,
        "wing_c": geometry.cbar,
        "wing_M": wing.M,
        "wing_epsilon": 0.9,
        "wing_alpha0": wing.alpha0,
    }
    if not wing.stalls:
        parameters |= {_ANGLES[c.symbol]: math.degrees(c.limit or 1.0) for c in aircraft.controls.values()}
    for coefficient, name in NAMES.items():
        parameters[f"{name}_O"] = d.get(f"{coefficient}_0", 0.0)
        for regressor in ("alpha", "beta", "p", "q", "r"):
            parameters[f"{name}_{regressor}"] = d.get(f"{coefficient}_{regressor}", 0.0)
        for symbol, (letter, sign) in CONTROLS.items():
            unit = form.units.get(symbol, 0.0)
            parameters[f"{name}_delta_{letter}"] = sign * unit * d.get(f"{coefficient}_{symbol}", 0.0)
    elevator = form.units.get("de", 0.0) * drag_slope(form.file, "de") if "de" in form.units else 0.0
    parameters |= {"C_D_q": drag_slope(form.file, "q"), "C_D_delta_e": elevator}
    return parameters | {"C_D_p": wing.parasitic, "C_L_O": wing.CL0, "C_L_alpha": wing.CLa}


def _servo(aircraft: Aircraft, rest: Effects) -> dict[str, float]:
    """The one lag of elevator and aileron: the mean of theirs."""
    lags = servo_lags(aircraft, rest)
    mean = sum(lags.values()) / len(lags) if lags else 0.0
    return {"servo_tau": mean or NO_SERVO_LAG}


def servo_lags(aircraft: Aircraft, rest: Effects) -> dict[str, float]:
    """Lags (s) of elevator and aileron, by control."""
    lags = first_order_lags(rest)
    return {c.name: lags.get(c.name, 0.0) for c in aircraft.controls.values() if c.symbol in ("de", "da")}


def servo_lines(aircraft: Aircraft, rest: Effects) -> list[str]:
    """What rosflight_sim does not hold of the servos, a line each."""
    lines, lags = second_order_line(rest), servo_lags(aircraft, rest)
    if lags and max(lags.values()) - min(lags.values()) > 1e-9:
        told = ", ".join(f"{name} {lag:g} s" for name, lag in lags.items())
        lines.append(
            f"actuator_lag: servo_tau is one for both, {sum(lags.values()) / len(lags):g} s, the mean of {told}"
        )
    rudder = {c.name: first_order_lags(rest).get(c.name, 0.0) for c in aircraft.controls.values() if c.symbol == "dr"}
    lines += [f"actuator_lag of {name} ({lag:g} s): rosflight_sim moves the rudder without a lag" for name, lag in
              rudder.items() if lag]  # fmt: skip
    offsets = {c.name: c.offset for c in aircraft.controls.values() if c.offset}
    return lines + [f"offset of {name}'s joint ({value:g} rad): surfaces count from zero" for name, value in
                    offsets.items()]  # fmt: skip


def _motor(aircraft: Aircraft, rest: Effects) -> dict[str, float]:
    """A motor without back-EMF: its torque is in proportion to the throttle, the propeller's to its speed squared.

    Its thrust then is so, too, at every airspeed, and the torque on the aircraft is a fixed share of it.
    """
    throttle = aircraft.throttle
    if throttle is None or throttle.max_thrust is None:
        return {}
    thrust = throttle.max_thrust * thrust_factor(rest)
    arm = max(-rest.get("thrust_yaw", {}).get("torque_arm", 0.0), _NO_TORQUE)
    rho, turns = aircraft.reference.air_density, _FULL_SPEED / (2.0 * math.pi)
    return {
        "D_prop": _DIAMETER,
        "CT_0": thrust / (rho * _DIAMETER**4 * turns**2),
        "CT_1": 0.0,
        "CT_2": 0.0,
        "CQ_0": arm * thrust / (rho * _DIAMETER**5 * turns**2),
        "CQ_1": 0.0,
        "CQ_2": 0.0,
        "KV": 1.0,
        "KQ": _KQ,
        "V_max": arm * thrust / _KQ,
        "R_motor": 1.0,
        "I_0": 0.0,
    }


def thrust_lines(aircraft: Aircraft, rest: Effects, *, arms: bool = True) -> list[str]:
    """What rosflight_sim does not hold of the thrust, a line each; ``arms``: also of the file's own line of it."""
    throttle, values = aircraft.throttle, rest.get("thrust_yaw", {})
    if throttle is None:
        return []
    lines = []
    if throttle.max_thrust is None:
        lines.append("thrust: the file states no largest thrust; keep your own motor and propeller")
    sizes = {
        "inclination": (throttle.inclination * arms, "rad"),
        "arm": (throttle.arm * arms, "m"),
        "thrust_yaw arm": (values.get("arm", 0.0), "m"),
        "thrust_yaw p_factor": (values.get("p_factor", 0.0), "m/rad"),
        "thrust_yaw torque_arm": (max(values.get("torque_arm", 0.0), 0.0), "m"),
    }
    why = "rosflight_sim's thrust lies in the body's x axis, and its torque rolls left"
    lines += [f"{name} of the thrust ({size:g} {unit}): {why}" for name, (size, unit) in sizes.items() if size]
    shift = [f"{axis} {value:g} m" for axis, value in rest.get("cg_shift", {}).items() if value]
    if shift:
        lines.append(
            f"cg_shift ({', '.join(shift)}): in the derivatives; rosflight_sim's thrust passes the new place, too"
        )
    return lines


def _read_back(text: str, form: _Form) -> Coefficients:
    """The coefficients of the written parameters, by ROSflight's equations."""
    with tempfile.TemporaryDirectory(prefix="sysid-") as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(text, encoding="utf-8")
        loads, density, units = rosflight_loads(path), form.file.aircraft.reference.air_density, form.units
    g = form.file.aircraft.geometry

    def coefficients(x: Columns) -> Array:
        half = 2.0 * x["V"]
        rates = (x["p"] * half / g.b, x["q"] * half / g.cbar, x["r"] * half / g.b)
        zero = np.zeros_like(x["V"])
        controls = {symbol: x[symbol] / units[symbol] if symbol in units else zero for symbol in CONTROLS}
        states = PlantStates(x["V"], x["alpha"], x["beta"], *rates, controls, zero)
        return nondimensional(loads(states), density, states, g)

    return coefficients


def number_text(value: float) -> str:
    """A YAML float; ROS would take 1 for an integer and refuse it, and YAML 1.1 takes 1e-12 for text."""
    text = f"{0.0 if abs(value) < 1e-15 else finite(value):.12g}"
    digits, exponent, power = text.partition("e")
    return f"{digits}{'' if '.' in digits else '.0'}{exponent}{power}"
