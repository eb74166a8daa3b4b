"""Reads the parameters of ROSflight's fixed-wing simulation (rosflight_sim, fixedwing_forces_and_moments).

Its equations are those of Beard & McLain (2012), "Small Unmanned Aircraft", ch. 4. Versions that know
``max_elevator_deflection_angle`` take deflections in rad and do not blend to a flat plate at stall; older ones take
deflections from -1 to 1 and blend. A file belongs to the first where it states such an angle.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from sysid_node.aircraft.model import Control, Geometry, Inertia
from sysid_node.errors import InputError
from sysid_node.sim.importing.imported import Imported, asymmetry_notes
from sysid_node.sim.importing.plant import LoadFunction, Plant, PlantEngine, PlantStates, aircraft_of

Array = NDArray[np.float64]

#: ROSflight's letter of each control, and the sign of the aircraft file's: there, aileron rolls left.
_CONTROLS = {"elevator": ("de", "e", 1.0), "aileron": ("da", "a", -1.0), "rudder": ("dr", "r", 1.0)}

#: Efficiency of the induced drag: a constant of rosflight_sim, which does not use wing_epsilon.
EFFICIENCY = 0.9

#: Half of rosflight_sim's servo_refresh_rate, s: a servo_tau of it lets surfaces follow within one step.
NO_SERVO_LAG = 0.0015

_LARGEST = 1e100  # of a number in a model, in any unit
_ANGLE = "max_{}_deflection_angle"

_ALPHA = np.deg2rad(np.arange(-20.0, 30.01, 0.5))
_BETA = np.array([-0.3, 0.0, 0.3])

#: The coefficients that rosflight_sim's equations read. One that is missing is zero there, after an error in its log.
_LONGITUDINAL = {"L": ("O", "alpha", "q", "delta_e"), "D": ("p", "q", "delta_e"), "m": ("O", "alpha", "q", "delta_e")}
_LATERAL = dict.fromkeys(("Y", "ell", "n"), ("O", "beta", "p", "r", "delta_a", "delta_r"))
_COEFFICIENTS = tuple(f"C_{c}_{r}" for c, named in (_LONGITUDINAL | _LATERAL).items() for r in named)

#: How many missing coefficients are named.
_NAMED = 6

_PROPELLER = ("D_prop", "CT_0", "CT_1", "CT_2", "CQ_0", "CQ_1", "CQ_2", "KQ", "V_max", "R_motor", "I_0")

#: Where ROSflight's own files have masses and inertias besides parameters: comments such as ``# Jx: 0.25``.
_COMMENT = re.compile(r"^#\s*(mass|Jx|Jy|Jz|Jxz)\s*:\s*([-+0-9.eE]+)\s*$", re.IGNORECASE | re.MULTILINE)


def read_rosflight(path: Path, airspeed: float | None = None) -> Imported:
    """The aircraft of a parameter file, expanded about level flight at ``airspeed`` (m/s). Raises InputError."""
    parameters, get = _getter(path)
    new = _in_radians(parameters)
    angles = {name: math.radians(get.or_else(_ANGLE.format(name), 40.0)) if new else 1.0 for name in _CONTROLS}
    controls = {
        name: Control(name, symbol, {name: sign}, limit=min(angles[name], math.pi / 2))
        for name, (symbol, _, sign) in _CONTROLS.items()
    }
    powered = any(name in parameters for name in _PROPELLER)
    model = _Model(get, blend=not new, powered=powered)
    lag = get.or_else("servo_tau", 0.0)
    lag = lag if lag > NO_SERVO_LAG else 0.0
    effects = {"actuator_lag": dict.fromkeys(("elevator", "aileron"), lag)} if lag else {}
    plant = Plant(
        name=path.stem,
        source=f"parameters of rosflight_sim in {path.name}",
        mass=get.positive("mass"),
        inertia=Inertia(get.positive("Jxx"), get.positive("Jyy"), get.positive("Jzz"), get.or_else("Jxz", 0.0)),
        geometry=model.geometry,
        density=model.density,
        controls=controls,
        air=model.air,
        engine=PlantEngine(model.engine) if powered else None,
        nodes={"alpha": _ALPHA, "beta": _BETA},
        effects=effects,
    )
    aircraft, level = aircraft_of(plant, airspeed)
    thrust = level.throttle * (aircraft.throttle.max_thrust or 0.0) if aircraft.throttle is not None else 0.0
    notes = _notes(new, lag, level.throttle if powered else None, thrust, level.airspeed)
    cross = max(abs(get.or_else(name, 0.0)) for name in ("Jxy", "Jyz"))
    largest = max(get(name) for name in ("Jxx", "Jyy", "Jzz"))
    notes = [*_missing(parameters), *notes, *asymmetry_notes(cross / largest)]
    if get.or_else("C_D_p", 0.0) <= 0.0:
        notes.append(
            "C_D_p is zero: rosflight_sim takes the parasitic drag from it (not from C_D_O), so there is none."
        )
    return Imported(aircraft, tuple(notes))


def rosflight_loads(path: Path) -> LoadFunction:
    """The airframe's loads (N, 6) of a parameter file; deflections in its own unit. Raises InputError."""
    parameters, get = _getter(path)
    return _Model(get, blend=not _in_radians(parameters), powered=False).air


def _getter(path: Path) -> tuple[dict[str, Any], _Getter]:
    parameters, comments = _read(path)
    return parameters, _Getter(parameters, comments, path)


def _in_radians(parameters: Mapping[str, Any]) -> bool:
    """Whether deflections are in rad, and the lift is linear."""
    return any(_ANGLE.format(name) in parameters for name in _CONTROLS)


def _missing(parameters: Mapping[str, Any]) -> list[str]:
    """A line that names the coefficients that the file does not have: one may be misspelt, or the file cut off."""
    missing = [name for name in _COEFFICIENTS if name not in parameters]
    if not missing:
        return []
    more = f" and {len(missing) - _NAMED} more" if len(missing) > _NAMED else ""
    return [
        f"Missing coefficients are taken as zero, as rosflight_sim takes them: {', '.join(missing[:_NAMED])}{more}."
    ]


def _notes(new: bool, lag: float, throttle: float | None, thrust: float, airspeed: float) -> list[str]:
    notes = [
        "Deflections are in rad, and the lift is linear: the file states a largest deflection, as versions of "
        "rosflight_sim do that do not blend at stall."
        if new
        else "Deflections run from -1 to 1 (per full deflection, not rad), and the lift blends to a flat plate's at "
        "wing_alpha0: the file states no max_elevator_deflection_angle, as older versions of rosflight_sim."
    ]
    notes.append("Between the tables' points, 0.5 degrees of alpha apart, the values are interpolated.")
    if lag:
        notes.append(
            f"servo_tau = {lag:g} s acts on elevator and aileron; rosflight_sim moves the rudder without a lag."
        )
    if throttle is None:
        notes.append("The file has no propeller and motor; the aircraft file has no throttle.")
    else:
        notes.append(
            f"Thrust is {thrust:.1f} N at throttle {throttle:.3f} and {airspeed:.1f} m/s; how it changes with "
            "airspeed, and how it differs from one in proportion to the throttle, is in the tables over V and throttle."
        )
    return notes


#: The names in such comments.
_ALIASES = {"Jxx": "jx", "Jyy": "jy", "Jzz": "jz", "Jxz": "jxz", "mass": "mass"}


class _Getter:
    """Numbers by name, with errors that name the file and the key."""

    def __init__(self, parameters: Mapping[str, Any], comments: Mapping[str, float], path: Path) -> None:
        self._parameters, self._comments, self._path = parameters, comments, path

    def __call__(self, name: str) -> float:
        if name not in self._parameters:
            comment = self._comments.get(_ALIASES.get(name, ""))
            if comment is not None:
                return comment
            raise InputError(f"{self._path}: {name} is missing; rosflight_sim needs it, and so does an aircraft file")
        value = self._parameters[name]
        if isinstance(value, str) and _is_number(value):  # -.99 is a number to ROS, and text to YAML 1.1
            value = float(value)
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < _LARGEST:
            raise InputError(f"{self._path}: {name}: got {value!r:.60}, expected a number")
        return float(value)

    def positive(self, name: str) -> float:
        """The number, above zero. Raises InputError."""
        value = self(name)
        if not value > 0.0:
            raise InputError(f"{self._path}: {name} is {value:g}; it must be above zero")
        return value

    def or_else(self, name: str, default: float) -> float:
        """The number, or the default where the file has none."""
        known = name in self._parameters or _ALIASES.get(name, "") in self._comments
        return self(name) if known else default


class _Model:
    """ROSflight's loads."""

    def __init__(self, get: _Getter, *, blend: bool, powered: bool) -> None:
        self.geometry = Geometry(get.positive("wing_s"), get.positive("wing_b"), get.positive("wing_c"))
        self.density = get.positive("rho")
        self._blend, self._M, self._alpha0 = blend, get("wing_M"), get("wing_alpha0")
        self._c = {name.removeprefix("C_"): get.or_else(name, 0.0) for name in _COEFFICIENTS}
        self._prop = {name: get(name) for name in _PROPELLER} if powered else {}

    def air(self, s: PlantStates) -> Array:
        """Loads (N, 6) of the airframe."""
        c, geometry = self._c, self.geometry
        p, r = (rate * geometry.b / (2.0 * s.airspeed) for rate in (s.p, s.r))
        q = s.q * geometry.cbar / (2.0 * s.airspeed)
        deflection = {letter: sign * s.controls[symbol] for symbol, letter, sign in _CONTROLS.values()}
        attached = c["L_O"] + c["L_alpha"] * s.alpha
        lift = self._blended(s.alpha, attached) + c["L_q"] * q + c["L_delta_e"] * deflection["e"]
        induced = attached**2 / (3.14159 * EFFICIENCY * geometry.b**2 / geometry.S)  # rosflight_sim's own pi
        drag = c["D_p"] + induced + c["D_q"] * q + c["D_delta_e"] * deflection["e"]
        lateral = [
            c[f"{n}_O"] + c[f"{n}_beta"] * s.beta + c[f"{n}_p"] * p + c[f"{n}_r"] * r
            + c[f"{n}_delta_a"] * deflection["a"] + c[f"{n}_delta_r"] * deflection["r"]
            for n in ("Y", "ell", "n")
        ]  # fmt: skip
        pitch = c["m_O"] + c["m_alpha"] * s.alpha + c["m_q"] * q + c["m_delta_e"] * deflection["e"]
        sin, cos = np.sin(s.alpha), np.cos(s.alpha)
        scale = 0.5 * self.density * s.airspeed**2 * geometry.S
        b, cbar = geometry.b, geometry.cbar
        rows = [-drag * cos + lift * sin, lateral[0], -drag * sin - lift * cos, b * lateral[1], cbar * pitch]
        return np.column_stack([scale * row for row in (*rows, b * lateral[2])])

    def _blended(self, alpha: Array, attached: Array) -> Array:
        """Lift of the wing: blended to a flat plate's at stall (Beard & McLain, eqs. 4.9 and 4.10)."""
        if not self._blend:
            return attached
        sigma = blending(alpha, self._M, self._alpha0)
        plate = 2.0 * np.where(alpha >= 0.0, 1.0, -1.0) * np.sin(alpha) ** 2 * np.cos(alpha)
        return np.asarray((1.0 - sigma) * attached + sigma * plate)

    def engine(self, s: PlantStates) -> Array:
        """Loads (N, 6) of motor and propeller: their balance of torques gives the rotor's speed (sec. 4.3 there)."""
        g, rho, speed = self._prop, self.density, s.airspeed
        D, turn = g["D_prop"], 2.0 * math.pi
        a = g["CQ_0"] * rho * D**5 / turn**2
        b = g["CQ_1"] * rho * D**4 / turn * speed + g["KQ"] ** 2 / g["R_motor"]
        c = g["CQ_2"] * rho * D**3 * speed**2 - g["KQ"] / g["R_motor"] * g["V_max"] * s.throttle + g["KQ"] * g["I_0"]
        omega = (-b + np.sqrt(np.maximum(b**2 - 4.0 * a * c, 0.0))) / (2.0 * a)
        thrust, torque = (
            rho * D ** (4 + n) * (g[f"{k}_0"] * (omega / turn) ** 2)
            + rho * D ** (3 + n) * g[f"{k}_1"] * speed * omega / turn
            + rho * D ** (2 + n) * g[f"{k}_2"] * speed**2
            for k, n in (("CT", 0), ("CQ", 1))
        )
        zero = np.zeros_like(speed)
        return np.column_stack([thrust, zero, zero, -torque, zero, zero])


def blending(alpha: Array, M: float, alpha0: float) -> Array:
    """0 in attached flow, 1 beyond the angle of stall (rad): Beard & McLain, eq. 4.10."""
    below, above = np.exp(-M * (alpha - alpha0)), np.exp(M * (alpha + alpha0))
    return np.asarray((1.0 + below + above) / ((1.0 + below) * (1.0 + above)))


def _read(path: Path) -> tuple[dict[str, Any], dict[str, float]]:
    """All parameters of all nodes of the file, and the numbers of comments such as ``# Jx: 0.25``."""
    try:
        text = path.read_text(encoding="utf-8")
        found = yaml.safe_load(text)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:  # ValueError: a date like 2026-13-45
        raise InputError(f"{path}: not valid YAML: {str(error).splitlines()[0]}") from error
    parameters: dict[str, Any] = {}
    for node in found.values() if isinstance(found, dict) else ():
        block = node.get("ros__parameters") if isinstance(node, dict) else None
        parameters |= block if isinstance(block, dict) else {}
    if "wing_s" not in parameters:
        raise InputError(f"{path}: not parameters of rosflight_sim's fixed wing (no wing_s under ros__parameters)")
    return parameters, {key.lower(): float(value) for key, value in _COMMENT.findall(text) if _is_number(value)}


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
