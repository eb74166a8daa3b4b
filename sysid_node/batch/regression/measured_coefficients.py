"""Aerodynamic coefficients from what was measured, and the regressors that should explain them.

Klein & Morelli, "Aircraft System Identification" (2006), eqs. 5.96 to 5.101: forces from the accelerometers, moments
from differentiated rates with all products of rates and Ixz. Everything is first referred to the centre of gravity.

What the aircraft file's lookup tables add is subtracted from the coefficients, so that regressions estimate the
derivatives on top of the tables. The regressor CL^2 is that of the whole lift.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from sysid_node.aircraft.model import Aircraft, LookupTable
from sysid_node.aircraft.stated_effects import stated_cg
from sysid_node.batch.regression.filtering import differentiate, pieces
from sysid_node.dynamics import scalar
from sysid_node.dynamics.airflow import speed_of
from sysid_node.dynamics.coefficients import regressors, with_polar
from sysid_node.dynamics.forces import lift_and_drag, thrust_axes, thrust_line
from sysid_node.dynamics.lever_arm import centripetal, tangential, velocity_from
from sysid_node.dynamics.rigid_body import known_moments
from sysid_node.dynamics.tables import array_tables, full_thrust, mach_number, need_mach
from sysid_node.dynamics.vector import Vector
from sysid_node.errors import InputError
from sysid_node.flight.csv_checks import likely_name
from sysid_node.flight.record import COLUMNS, Array, FlightRecord

_AXES = ("x", "y", "z")
_ALWAYS = ("ax", "ay", "az", "p", "q", "r", "V")

#: Share of the reference airspeed below which nothing flies: on the ground, coefficients would divide by nothing.
_SLOWEST = 0.2


@dataclass(frozen=True)
class MeasuredCoefficients:
    """Both sides of the six equations at each time of a flight.

    ``coefficients`` CL CD CY Cl Cm Cn as far as they can be formed, less what lookup tables add (``tabulated``),
    besides the whole CX and CZ (body axes); ``regressors`` by the names of derivatives ("0", "alpha", "q", "de", ...);
    each (N,), finite. ``left_out`` samples lacked a value or did not fly; ``noise`` holds the sensors' 1 sigma in those
    regressors that have one.
    """

    name: str
    time: Array
    coefficients: Mapping[str, Array]
    regressors: Mapping[str, Array]
    left_out: int = 0
    remarks: tuple[str, ...] = ()
    noise: Mapping[str, float] = field(default_factory=dict)
    tabulated: Mapping[str, Array] = field(default_factory=dict)


def measured_coefficients(aircraft: Aircraft, record: FlightRecord) -> MeasuredCoefficients:
    """The equations of a flight. Raises InputError where a signal that the aircraft's model needs was never measured.

    Where the aircraft has an engine and its thrust was not measured, drag cannot be told from thrust: CD is left out.
    """
    _check_measured(aircraft, record)
    complete, left_out = _complete_samples(aircraft, record)
    s = at_cg(aircraft, complete)
    coefficients, remarks = _coefficients(aircraft, s)
    regressors = _regressors(aircraft, s, coefficients["CL"])
    tabulated = _tabulated(aircraft, s, regressors)
    if left_out:
        remarks.append(
            f"{record.name or 'flight'}: {left_out} of {len(record)} samples lack a value or are slower than "
            f"{_SLOWEST * aircraft.reference.airspeed:.3g} m/s, and were left out"
        )
    noise = _noise(aircraft, float(s["V"].mean()))
    return MeasuredCoefficients(
        record.name or "flight",
        complete.time,
        _less(coefficients, tabulated),
        regressors,
        left_out,
        tuple(remarks),
        noise,
        tabulated,
    )


def _noise(aircraft: Aircraft, airspeed: float) -> dict[str, float]:
    """What the aircraft file's sensor noise makes of the regressors."""
    b, cbar, known = aircraft.geometry.b, aircraft.geometry.cbar, aircraft.noise
    noise = {name: known[name] for name in ("alpha", "beta") if name in known}
    if "gyro" in known:
        noise |= {name: known["gyro"] * length / (2.0 * airspeed) for name, length in (("p", b), ("q", cbar), ("r", b))}
    return noise


@dataclass(frozen=True)
class ReadingSensitivity:
    """How one sensor's reading enters both sides of the equations, at each time: derivatives (N,) by name."""

    coefficients: Mapping[str, Array]
    regressors: Mapping[str, Array]


#: Sensors that enter the equations not only through one additive term, and a small step of their reading (m/s, rad).
_STEPS = {"V": 1e-4, "alpha": 1e-5, "beta": 1e-5}


def sensitivity_to_readings(aircraft: Aircraft, record: FlightRecord) -> dict[str, tuple[Array, ReadingSensitivity]]:
    """The air data's readings (N,), and how the equations depend on each, at the times of ``equations``."""
    s = _accelerated(_complete_samples(aircraft, record)[0])

    def sides(name: str, step: float) -> tuple[dict[str, Array], dict[str, Array]]:
        moved = _moved_to_cg(aircraft, {**s, name: s[name] + step})
        coefficients, _ = _coefficients(aircraft, moved)
        regressors = _regressors(aircraft, moved, coefficients["CL"])
        return _less(coefficients, _tabulated(aircraft, moved, regressors)), regressors

    found = {}
    for name, step in _STEPS.items():
        if name in s:
            above, below = sides(name, step), sides(name, -step)
            slopes = [{n: (a[n] - b[n]) / (2.0 * step) for n in a} for a, b in zip(above, below, strict=True)]
            found[name] = s[name], ReadingSensitivity(*slopes)
    return found


def at_cg(aircraft: Aircraft, record: FlightRecord) -> dict[str, Array]:
    """The record's signals with specific forces and air data moved to the CG, and angular accelerations ``pdot`` ..."""
    return _moved_to_cg(aircraft, _accelerated(record))


def _accelerated(record: FlightRecord) -> dict[str, Array]:
    """The record's signals and angular accelerations ``pdot`` ..."""
    time = record.time.tobytes()
    rates = {f"{name}dot": _derivative(time, record[name].tobytes()) for name in "pqr"}
    return {name: values.copy() for name, values in record.columns.items()} | rates


@lru_cache(maxsize=6)
def _derivative(time: bytes, signal: bytes) -> Array:
    """The derivative (N,) of a signal, read-only; both as bytes of float64.

    The last ones are kept: systematic errors are found from dozens of variants of a flight, and few change its rates.
    """
    slope = differentiate(np.frombuffer(time), np.frombuffer(signal))
    slope.flags.writeable = False
    return slope


def _moved_to_cg(aircraft: Aircraft, signals: Mapping[str, Array]) -> dict[str, Array]:
    s = dict(signals)
    rates, accelerations = (Vector(s["p"], s["q"], s["r"]), Vector(s["pdot"], s["qdot"], s["rdot"]))
    imu, probe = aircraft.sensors.imu, aircraft.sensors.air_data
    # where the search of the maximum-likelihood methods stops depends on the last bit of its inputs: the order of
    # operations here and in ``_moments`` is that of all results so far
    relative = tangential(accelerations, imu).plus(centripetal(rates, imu))
    force = Vector(s["ax"], s["ay"], s["az"]).minus(relative)
    s |= dict(zip(("ax", "ay", "az"), force, strict=True))
    if any(probe):
        alpha, beta = (s.get(name, np.zeros_like(s["V"])) for name in ("alpha", "beta"))
        direction = Vector(np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta))
        velocity = velocity_from(direction.times(s["V"]), rates, probe)
        s["V"] = speed_of(velocity, np)
        s["alpha"] = np.arctan2(velocity[2], velocity[0])
        s["beta"] = np.arctan2(velocity[1], np.hypot(velocity[0], velocity[2]))
    return s


def _needed(aircraft: Aircraft) -> list[str]:
    """Columns without which the model cannot be formed."""
    regressors = {name for names in aircraft.model_structure.values() for name in names}
    regressors |= {name for table in _tables(aircraft) for name in table.over}
    longitudinal = {"CL", "CD"} & set(aircraft.model_structure)
    angles = [name for name in ("alpha", "beta") if name in regressors or (name == "alpha" and longitudinal)]
    return [*_ALWAYS, *angles, *(symbol for symbol in aircraft.control_symbols if symbol in regressors)]


def _check_measured(aircraft: Aircraft, record: FlightRecord) -> None:
    missing = [name for name in _needed(aircraft) if not record.measured(name)]
    if missing:
        raise InputError(
            f"flight {record.name!r}: {', '.join(missing)} not measured, which the model of aircraft {aircraft.name} "
            f"needs; {_remedy(missing, [name for name in record.columns if name not in COLUMNS])}"
        )


def _remedy(missing: Sequence[str], others: Sequence[str]) -> str:
    """What to do where columns are missing, in a flight that has ``others`` besides those of every flight."""
    meant = [(name, other) for name in missing if (other := likely_name(name, others))]
    if meant:
        return "; ".join(f"is {other!r} what is called {name!r} here? Rename it then" for name, other in meant)
    if {*missing} <= {"alpha", "beta"}:
        return "record it, or use output_error or filter_error, which need no vanes"
    if {*missing} <= {*_ALWAYS}:
        return "record it"
    return "record it, or take the derivatives by it out of the aircraft file"


def _complete_samples(aircraft: Aircraft, record: FlightRecord) -> tuple[FlightRecord, int]:
    """The samples in flight with every needed value, and how many others there were.

    Density is the reference's if unknown. A sample alone between interruptions has no angular acceleration.
    """
    optional = [name for name in ("alpha", "beta", "rho", "thrust") if record.measured(name)]
    names = list(dict.fromkeys([*_needed(aircraft), *optional]))
    slowest = _SLOWEST * aircraft.reference.airspeed
    kept = np.all([np.isfinite(record[name]) for name in names], axis=0) & (record["V"] > slowest)
    alone = [part.start for part in pieces(record.time[kept]) if part.stop == part.start + 1]
    kept[np.flatnonzero(kept)[alone]] = False
    if kept.sum() < 10:
        raise InputError(
            f"flight {record.name!r}: only {int(kept.sum())} of {len(record)} samples hold all of {', '.join(names)} "
            f"at more than {slowest:.3g} m/s; give a longer flight, or one in which the aircraft flies"
        )
    columns = {name: record[name][kept] for name in names}
    columns.setdefault("rho", np.full(int(kept.sum()), aircraft.reference.air_density))
    return FlightRecord(record.time[kept], columns, record.name, record.start_ns), int((~kept).sum())


def _coefficients(aircraft: Aircraft, s: Mapping[str, Array]) -> tuple[dict[str, Array], list[str]]:
    throttle, remarks = aircraft.throttle, []
    thrust = s.get("thrust", np.zeros_like(s["V"]))
    inclination, arm = thrust_line(throttle)
    forward, down = thrust_axes(inclination, scalar)
    force = 0.5 * s["rho"] * s["V"] ** 2 * aircraft.geometry.S
    c = {
        "CX": (aircraft.mass * s["ax"] - thrust * forward) / force,
        "CY": aircraft.mass * s["ay"] / force,
        "CZ": (aircraft.mass * s["az"] - thrust * down) / force,
    }
    alpha = s.get("alpha", np.zeros_like(s["V"]))
    c["CL"], drag = lift_and_drag(c["CX"], c["CZ"], np.cos(alpha), np.sin(alpha))
    if throttle is None or "thrust" in s:
        c["CD"] = drag
    elif "CD" in aircraft.model_structure:
        remarks.append("thrust was not measured: drag cannot be told from it, and CD is left out")
    moments, unknown = _moments(aircraft, s, force, thrust * arm)
    moments = _about_file(aircraft, s, force, moments)
    return c | moments, remarks + [f"{name} left out: {reason}" for name, reason in unknown.items()]


def _moments(
    aircraft: Aircraft, s: Mapping[str, Array], force: Array, thrust_moment: Array
) -> tuple[dict[str, Array], dict[str, str]]:
    """Moment coefficients, and those that cannot be formed with the reason."""
    inertia, geometry = aircraft.inertia, aircraft.geometry
    known, p, q, r = known_moments(inertia), s["p"], s["q"], s["r"]
    roll = known.Ixx * s["pdot"] - known.Ixz * (s["rdot"] + p * q) + (known.Izz - known.Iyy) * q * r
    pitch = known.Iyy * s["qdot"] + (known.Ixx - known.Izz) * p * r + known.Ixz * (p**2 - r**2)
    yaw = known.Izz * s["rdot"] - known.Ixz * (s["pdot"] - q * r) + (known.Iyy - known.Ixx) * p * q
    moments = {
        "Cl": roll / (force * geometry.b),
        "Cm": (pitch - thrust_moment) / (force * geometry.cbar),
        "Cn": yaw / (force * geometry.b),
    }
    about = {"Cl": inertia.Ixx, "Cm": inertia.Iyy, "Cn": inertia.Izz}
    unknown = {
        name: "its moment of inertia is not in the aircraft file"
        for name, moment in about.items()
        if math.isnan(moment) and name in aircraft.model_structure
    }
    return {name: value for name, value in moments.items() if not math.isnan(about[name])}, unknown


def _about_file(
    aircraft: Aircraft, s: Mapping[str, Array], force: Array, moments: dict[str, Array]
) -> dict[str, Array]:
    """Moments about the file's point, where the file states that the CG is elsewhere: shift x force is added."""
    shift = stated_cg(aircraft)
    if not any(shift):
        return moments
    more = Vector(*shift).cross(Vector(s["ax"], s["ay"], s["az"])).times(aircraft.mass)
    b, cbar = aircraft.geometry.b, aircraft.geometry.cbar
    terms = {"Cl": more.x / (force * b), "Cm": more.y / (force * cbar), "Cn": more.z / (force * b)}
    return {name: value + terms[name] for name, value in moments.items()}


def _tables(aircraft: Aircraft) -> list[LookupTable]:
    """The tables of those coefficients that the aircraft's model has derivatives of."""
    return [table for table in aircraft.tables if table.coefficient in aircraft.model_structure]


def _tabulated(aircraft: Aircraft, s: Mapping[str, Array], regressors: Mapping[str, Array]) -> dict[str, Array]:
    """What the aircraft file's tables add to the coefficients, (N,) each."""
    tables = _tables(aircraft)
    if not tables:
        return {}
    mach = {"Mach": mach_number(s["V"], s["rho"], np)} if need_mach(tables) else {}
    throttle = s.get("thrust", np.zeros_like(s["V"])) / full_thrust(aircraft)
    return array_tables(tables)({**regressors, "V": s["V"], "throttle": throttle, **mach})


def _less(coefficients: Mapping[str, Array], tabulated: Mapping[str, Array]) -> dict[str, Array]:
    """The coefficients without what the tables add."""
    return {name: c - tabulated[name] if name in tabulated else c for name, c in coefficients.items()}


def _regressors(aircraft: Aircraft, s: Mapping[str, Array], lift: Array) -> dict[str, Array]:
    """Regressors (N,) by name, as far as they were measured."""
    geometry, rates = aircraft.geometry, (s["p"], s["q"], s["r"])
    flow, one = (s["V"], s.get("alpha"), s.get("beta")), np.ones_like(s["V"])
    formed = regressors(flow, rates, geometry.b, geometry.cbar, aircraft.reference.airspeed, one)
    controls = {symbol: s[symbol] for symbol in aircraft.control_symbols if symbol in s}
    return {name: x for name, x in with_polar(formed, lift).items() if x is not None} | controls
