"""Reads a JSBSim model into an aircraft file's contents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import (
    Aircraft,
    Control,
    Derivative,
    Geometry,
    Inertia,
    ReferenceCondition,
    Sensors,
    Throttle,
    UncertainValue,
)
from sysid_node.aircraft.names import CONTROL_SYMBOLS
from sysid_node.sim.importing.expansion import Expansion, TableAxis, expand, largest_error
from sysid_node.sim.importing.imported import Imported, asymmetry_notes
from sysid_node.sim.importing.jsbsim.actuators import JsbsimServo
from sysid_node.sim.importing.jsbsim.coefficients import CoefficientModel
from sysid_node.sim.importing.jsbsim.files import ModelFiles
from sysid_node.sim.importing.jsbsim.program import Program
from sysid_node.sim.importing.jsbsim.surfaces import JsbsimSurface, properties_read
from sysid_node.sim.importing.jsbsim.survey import surveyed
from sysid_node.sim.importing.jsbsim.trim import SteadyFlight

Array = NDArray[np.float64]

#: A table's smallest part, as a share of what each variable changes in an ordinary flight.
_SHARE = 5e-4
#: 1 sigma of the engine's lag and delay, as a share: real engines lag more at one throttle than at another.
_LAG_SHARE = 0.2
_ORDINARY = {"alpha": 0.1, "beta": 0.1, "p": 0.05, "q": 0.005, "r": 0.05}


@dataclass(frozen=True)
class JsbsimModel:
    """A model as read: its files, controls, steady flight, and the aircraft."""

    files: ModelFiles
    surfaces: tuple[JsbsimSurface, ...]
    steady: SteadyFlight
    imported: Imported


def read_jsbsim(model: str, airspeed: float | None = None, altitude: float | None = None) -> Imported:
    """The aircraft of a JSBSim model: the path of its XML, or the name of an aircraft that comes with JSBSim.

    Coefficients are expanded about level flight at ``airspeed`` (m/s) and ``altitude`` (m). Raises InputError.
    """
    return read_model(model, airspeed, altitude).imported


def read_model(model: str, airspeed: float | None = None, altitude: float | None = None) -> JsbsimModel:
    """The same with what a flight in JSBSim itself needs."""
    with surveyed(model, airspeed, altitude) as found:
        survey, program, aerodynamics = found
        model_ = CoefficientModel(program, survey.surfaces, survey.steady)
        axes = model_.axes(aerodynamics)
        expansion = expand(model_, axes, _tolerance(model_, axes))
        lag, delay = survey.lever_times
        model_.motor_lag, model_.throttle_delay = model_.motor_lag + lag, model_.throttle_delay + delay
        aircraft = _aircraft(survey.files, program, survey.surfaces, survey.steady, model_, expansion, survey.servos)
        notes = [
            *_notes(program, survey.surfaces, survey.steady, model_, survey.servos),
            *_unmoved(program, survey.surfaces, aerodynamics),
            *_remainder(model_, expansion, axes),
        ]
        imported = Imported(aircraft, tuple(notes))
    return JsbsimModel(survey.files, survey.surfaces, survey.steady, imported)


def _tolerance(model: CoefficientModel, axes: Mapping[str, TableAxis]) -> Array:
    """What may be left out of each coefficient (6,)."""
    sizes = {**_ORDINARY, "V": 0.1 * model.centre["V"]}
    rows = []
    for name, axis in axes.items():
        step = min(sizes.get(name, 0.1), axis.nodes[-1] - axis.centre, axis.centre - axis.nodes[0])
        step = step or sizes.get(name, 0.1)
        rows += [{**model.centre, name: axis.centre + sign * step} for sign in (-1.0, 1.0)]
    found = model({name: np.array([row[name] for row in rows]) for name in model.centre})
    return np.asarray(_SHARE * np.ptp(found, axis=0) + 1e-9)


def _aircraft(
    files: ModelFiles,
    program: Program,
    surfaces: Sequence[JsbsimSurface],
    steady: SteadyFlight,
    model: CoefficientModel,
    expansion: Expansion,
    servos: Mapping[str, JsbsimServo],
) -> Aircraft:
    state = steady.state
    controls = {
        s.name: Control(s.name, CONTROL_SYMBOLS[s.name], {s.name: s.sign}, limit=min(s.limit, np.pi / 2))
        for s in surfaces
    }
    throttle = None
    if program.powered and model.thrust > 0.0:
        throttle = Throttle("throttle", model.thrust / state.throttle, model.inclination, model.arm)
    return Aircraft(
        name=files.name,
        source=(
            f"JSBSim's model {files.name}, coefficients about level flight at {state.airspeed:.1f} m/s and "
            f"{state.altitude:.0f} m, alpha {state.alpha:.4f} rad; joints are JSBSim's surface positions, rad"
        ),
        mass=program.mass,
        inertia=Inertia(**program.inertia),
        geometry=Geometry(*program.geometry),
        reference=ReferenceCondition(state.airspeed, model.steady_loads.density),
        controls=controls,
        derivatives={name: Derivative(value) for name, value in expansion.derivatives.items()},
        throttle=throttle,
        sensors=Sensors(imu=program.named_place("eyepoint")),
        ideal=True,
        effects=_effects(model, servos),
        tables=expansion.tables,
    )


def _effects(model: CoefficientModel, servos: Mapping[str, JsbsimServo]) -> dict[str, dict[str, UncertainValue]]:
    effects: dict[str, dict[str, UncertainValue]] = {}
    for control, servo in servos.items():
        for effect, size in servo.effects().items():
            effects.setdefault(effect, {})[control] = UncertainValue(size)
    dampings = [servo.damping for servo in servos.values() if servo.lag]
    if dampings and max(dampings) > 0.0:
        effects["actuator_lag"] |= _second_order(servos, dampings)
    if model.throttle_delay:
        delay = UncertainValue(model.throttle_delay, _LAG_SHARE * model.throttle_delay)
        effects.setdefault("command_delay", {})["throttle"] = delay
    if model.motor_lag:
        effects["motor_lag"] = {"time_constant": UncertainValue(model.motor_lag, _LAG_SHARE * model.motor_lag)}
    lift, moment = model.unsteady.slopes[[0, 4]]
    if lift or moment:
        terms = {"CL_alphadot": lift, "Cm_alphadot": moment}
        effects["unsteady_aerodynamics"] = {name: UncertainValue(float(value)) for name, value in terms.items()}
    return effects


def _second_order(servos: Mapping[str, JsbsimServo], dampings: Sequence[float]) -> dict[str, UncertainValue]:
    """The one damping of all servos; where they differ, lags of first order that follow a ramp as late."""
    if max(dampings) - min(dampings) < 1e-6:
        return {"damping": UncertainValue(dampings[0])}
    late = {n: s.lag * (2.0 * s.damping if s.damping else 1.0) for n, s in servos.items() if s.lag}
    return {name: UncertainValue(lag) for name, lag in late.items()}


def _notes(
    program: Program,
    surfaces: Sequence[JsbsimSurface],
    steady: SteadyFlight,
    model: CoefficientModel,
    servos: Mapping[str, JsbsimServo],
) -> list[str]:
    """What the file does not hold, or what a user should know, a sentence each."""
    notes = []
    for surface in surfaces:
        if surface.feedback:
            laws = ", ".join(sorted(set(servos[surface.name].laws))[:3]) or "the motion"
            notes.append(f"The {surface.name}'s position depends on {laws} in JSBSim; a file holds no control law, "
                         f"and its joint is the surface's position.")  # fmt: skip
        low, high = surface.deflection[0], surface.deflection[-1]
        if abs(low + high) > 0.05 * (high - low):
            notes.append(f"The {surface.name} moves from {low:.3f} to {high:.3f} rad; a file has one limit both ways.")
        if not surface.position.endswith(("-rad", "-deg")):
            notes.append(f"The {surface.name}'s joint is {surface.position}, without unit, for there is none in rad.")
    notes += asymmetry_notes(program.cross_products)
    left = [
        n for n, v in zip(("CD", "CY", "Cl", "Cn"), model.unsteady.slopes[[1, 2, 3, 5]], strict=True) if abs(v) > 0.01
    ]
    if left:
        notes.append(f"Terms of {', '.join(left)} in the rate of alpha are left out; a file has those of CL and Cm.")
    if len({round(s.damping, 6) for s in servos.values() if s.lag}) > 1:
        notes.append(
            "Servos of second order have different dampings; a file has one, and lags of first order are held."
        )
    if program.powered:
        notes.append(_thrust_note(steady, model))
    notes.append(
        "The IMU's place is the model's eye point, the pilot's; flow angles are those at the centre of gravity."
    )
    return notes


def _unmoved(program: Program, surfaces: Sequence[JsbsimSurface], aerodynamics: Sequence[Element]) -> list[str]:
    """What of the flight control system the aerodynamics read besides the three controls and the throttle."""
    moved = {name for surface in surfaces for name in surface.properties}
    left = sorted(n for n in properties_read(aerodynamics) - moved if program.has(n) and "throttle" not in n)
    if not left:
        return []
    return [f"The aerodynamics also read {', '.join(left)}, which neither elevator, aileron nor rudder moves; a file "
            "of JSBSim has no such control, and they are held as they are without a command."]  # fmt: skip


def _thrust_note(steady: SteadyFlight, model: CoefficientModel) -> str:
    """How the thrust follows the throttle."""
    return (
        f"Thrust is {model.thrust:.0f} N at throttle {steady.state.throttle:.2f} and {steady.state.airspeed:.1f} m/s"
        + (f", with a lag of {model.motor_lag:.2f} s" if model.motor_lag else "")
        + (f" after a delay of {model.throttle_delay:.2f} s" if model.throttle_delay else "")
        + "; how it changes with airspeed, and how it differs from one in proportion to the throttle, is in the "
        "tables over V and throttle."
    )


def _remainder(model: CoefficientModel, expansion: Expansion, axes: Mapping[str, TableAxis]) -> list[str]:
    """What terms of three variables leave, where it is not negligible."""
    error, size = largest_error(model, expansion, axes, 0.25, 150)
    shares = error / np.maximum(size, 1e-12)
    names = ("CL", "CD", "CY", "Cl", "Cm", "Cn")
    large = [f"{name} {share:.1%}" for name, share in zip(names, shares, strict=True) if share > 0.005]
    if not large:
        return []
    return [f"With all variables at a quarter of their range at once, derivatives and tables miss: {', '.join(large)} "
            "of the coefficient's range (terms of three variables)."]  # fmt: skip
