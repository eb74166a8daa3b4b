"""Known effects put into a record, or into what is believed of the aircraft.

A record is edited by the equations of the effects (``sysid_node/sim/effects``): after the edit, what was recorded is
what an aircraft with the effect would have recorded in the same motion and the same air. Its noise stays, and so does
all that no model knows. An effect of mass, inertia, aerodynamics or the centre of gravity is put in by an aircraft file
that does not know it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from sysid_node.aircraft.model import Aircraft, Derivative
from sysid_node.dynamics.airflow import flow_angles, velocity_of
from sysid_node.dynamics.lever_arm import specific_force_at, velocity_at
from sysid_node.dynamics.vector import Vector
from sysid_node.flight.record import FlightRecord

Array = NDArray[np.float64]
Values = Mapping[str, float]

_IMU = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi")
_AIR = ("V", "alpha", "beta")
_SURFACES = {"elevator": "de", "aileron": "da", "rudder": "dr"}

#: Corner of the low-pass before rates are differentiated, Hz, and before a lag is undone.
_CORNER = 8.0


def edited(record: FlightRecord, effect: str, values: Values) -> FlightRecord:
    """The record with an effect in it; the record itself where the effect is one of the belief."""
    editor = _EDITORS.get(effect)
    return record if editor is None else replace(record, columns={**record.columns, **editor(record, values)})


def misbelieved(aircraft: Aircraft, effect: str, values: Values) -> Aircraft:
    """The aircraft file that does not know an effect of the belief; the file itself where it is one of the record."""
    misbelief = _MISBELIEFS.get(effect)
    return aircraft if misbelief is None else misbelief(aircraft, values)


def _late(record: FlightRecord, names: tuple[str, ...], seconds: float) -> dict[str, Array]:
    """Columns stamped so many seconds late: what is read now happened then."""
    then = np.clip(record.time - seconds, record.time[0], record.time[-1])
    found = {}
    for name in (name for name in names if np.isfinite(record[name]).all()):
        values = record[name]
        smooth = name in _IMU + _AIR
        found[name] = CubicSpline(record.time, values)(then) if smooth else np.interp(then, record.time, values)
    return found


def _surfaces(record: FlightRecord) -> tuple[str, ...]:
    return tuple(symbol for symbol in _SURFACES.values() if record.measured(symbol))


def _smooth(record: FlightRecord, values: Array) -> Array:
    rate = 1.0 / float(np.median(np.diff(record.time)))
    if rate <= 2.5 * _CORNER:
        return values
    smooth: Array = sosfiltfilt(butter(2, _CORNER, fs=rate, output="sos"), values)
    return smooth


def _rates(record: FlightRecord) -> tuple[Vector, Vector]:
    """Angular rates (rad/s) and accelerations (rad/s^2); zero where not measured."""
    rates = [np.nan_to_num(record[name]) for name in "pqr"]
    return Vector(*rates), Vector(*(np.gradient(_smooth(record, w), record.time) for w in rates))


def _lagged_position(record: FlightRecord, values: Values) -> dict[str, Array]:
    """Commands whose lag gives the recorded positions."""
    tau = values["time_constant"]
    return {s: record[s] + tau * np.gradient(_smooth(record, record[s]), record.time) for s in _surfaces(record)}


def _weaker(record: FlightRecord, values: Values) -> dict[str, Array]:
    """Commands of which only a part was done from the onset on."""
    found, lasting = {}, record.time >= values.get("onset", -10.0)
    for name, fraction in values.items():
        if name != "onset":
            symbol = _SURFACES[name]
            found[symbol] = np.where(lasting, record[symbol] / (1.0 - fraction), record[symbol])
    return found


def _held(record: FlightRecord, values: Values) -> dict[str, Array]:
    """Steps commanded to a surface that rests: it did not follow them."""
    found = {}
    for name, size in values.items():
        if name in _SURFACES:
            symbol, phase = _SURFACES[name], np.floor((record.time - 3.0) / 0.8).astype(int)
            pattern = np.where((phase >= 0) & (phase < 14), np.array([1, 1, 1, -1, -1, 1, -1])[phase % 7], 0)
            found[symbol] = record[symbol] + size * pattern
    return found


def _biased(record: FlightRecord, values: Values) -> dict[str, Array]:
    return {name: record[name] + bias for name, bias in values.items()}


def _scaled(record: FlightRecord, values: Values) -> dict[str, Array]:
    return {name: record[name] * (1.0 + error) for name, error in values.items()}


def _turned(record: FlightRecord, values: Values) -> dict[str, Array]:
    """Readings of an IMU that is turned by small angles."""
    angle = Vector(*(values.get(axis, 0.0) for axis in ("roll", "pitch", "yaw")))
    found = {}
    for names in (("ax", "ay", "az"), ("p", "q", "r")):
        reading = Vector(*(np.nan_to_num(record[name]) for name in names))
        found |= dict(zip(names, reading.minus(angle.cross(reading)), strict=True))
    return _as_measured(record, found)


def _imu_elsewhere(record: FlightRecord, values: Values) -> dict[str, Array]:
    """Readings of accelerometers that sit ``values`` (m) off their place."""
    rates, turning = _rates(record)
    force = Vector(*(np.nan_to_num(record[name]) for name in ("ax", "ay", "az")))
    there = specific_force_at(force, rates, turning, (values.get("x", 0.0), values.get("y", 0.0), values.get("z", 0.0)))
    return _as_measured(record, dict(zip(("ax", "ay", "az"), there, strict=True)))


def _vanes_elsewhere(record: FlightRecord, values: Values) -> dict[str, Array]:
    """Readings of a probe that sits ``values`` (m) off its place."""
    rates, _ = _rates(record)
    velocity = velocity_of([np.nan_to_num(record[name]) for name in _AIR], np)
    arm = (values.get("x", 0.0), values.get("y", 0.0), values.get("z", 0.0))
    flow = flow_angles(velocity_at(velocity, (rates.x, rates.y, rates.z), arm), np)
    return _as_measured(record, dict(zip(_AIR, map(np.asarray, flow), strict=True)))


def _as_measured(record: FlightRecord, columns: dict[str, Array]) -> dict[str, Array]:
    """Without the columns that the record does not have."""
    return {name: values for name, values in columns.items() if np.isfinite(record[name]).all()}


_EDITORS: Mapping[str, Callable[[FlightRecord, Values], dict[str, Array]]] = {
    "imu_delay": lambda record, values: _late(record, _IMU, values["delay"]),
    "air_data_delay": lambda record, values: _late(record, _AIR, values["delay"]),
    "actuator_stamp_delay": lambda record, values: _late(record, _surfaces(record), values["delay"]),
    "command_delay": lambda record, values: _late(record, _surfaces(record), -values["delay"]),
    "actuator_lag": _lagged_position,
    "control_effectiveness_loss": _weaker,
    "stuck_surface": _held,
    "imu_bias": _biased,
    "imu_scale": _scaled,
    "imu_misalignment": _turned,
    "imu_lever_arm": _imu_elsewhere,
    "vane_bias": _biased,
    "vane_scale": _scaled,
    "vane_lever_arm": _vanes_elsewhere,
    "airspeed_scale": lambda record, values: {"V": record["V"] * (1.0 + values["error"])},
}


def _other_mass(aircraft: Aircraft, values: Values) -> Aircraft:
    return replace(aircraft, mass=aircraft.mass / (1.0 + values["error"]))


def _other_inertia(aircraft: Aircraft, values: Values) -> Aircraft:
    moments = {axis: getattr(aircraft.inertia, axis) / (1.0 + error) for axis, error in values.items()}
    return replace(aircraft, inertia=replace(aircraft.inertia, **moments))


def _other_derivatives(aircraft: Aircraft, values: Values) -> Aircraft:
    """Derivatives less by ``values`` than they are; their tolerances stay."""
    changed = {n: replace(aircraft.derivatives[n], value=aircraft.derivatives[n].value - d) for n, d in values.items()}
    return replace(aircraft, derivatives={**aircraft.derivatives, **changed})


def _other_cg(aircraft: Aircraft, values: Values) -> Aircraft:
    """Moments about a point ``x`` (m) behind the CG, and sensors so much farther forward of it.

    About a point behind the CG lift pitches up more: Cm' = Cm + CL x / cbar, Cn' = Cn - CY x / b (Klein & Morelli
    (2006), ch. 3; CZ is taken as -CL).
    """
    x, geometry = values["x"], aircraft.geometry
    arms = {"Cm": ("CL", x / geometry.cbar), "Cn": ("CY", -x / geometry.b)}
    derivatives = dict(aircraft.derivatives)
    for name, derivative in aircraft.derivatives.items():
        coefficient, _, regressor = name.partition("_")
        if coefficient in arms:
            force, share = arms[coefficient]
            more = aircraft.derivatives.get(f"{force}_{regressor}", Derivative(0.0)).value
            derivatives[name] = replace(derivative, value=derivative.value + share * more)
    sensors = replace(aircraft.sensors, imu=(x, 0.0, 0.0), air_data=(x, 0.0, 0.0))
    return replace(aircraft, derivatives=derivatives, sensors=sensors)


_MISBELIEFS: Mapping[str, Callable[[Aircraft, Values], Aircraft]] = {
    "mass_error": _other_mass,
    "inertia_error": _other_inertia,
    "derivative_error": _other_derivatives,
    "cg_shift": _other_cg,
}

#: Effects that can be put in.
EFFECTS = (*_EDITORS, *_MISBELIEFS)
