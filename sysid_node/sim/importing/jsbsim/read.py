"""Reads a JSBSim model into an aircraft file's contents."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import (
    Aircraft,
    Control,
    Derivative,
    Geometry,
    Inertia,
    Reference,
    Sensors,
    Throttle,
    UncertainValue,
)
from sysid_node.aircraft.names import CONTROL_SYMBOLS
from sysid_node.errors import InputError
from sysid_node.sim.importing.expansion import Axis, Expansion, expand, largest_error
from sysid_node.sim.importing.imported import Imported
from sysid_node.sim.importing.jsbsim.actuators import Servo, chain_to, read_servo
from sysid_node.sim.importing.jsbsim.coefficients import CoefficientModel
from sysid_node.sim.importing.jsbsim.files import ModelFiles, copy_model, find_model, outputs_of, sections
from sysid_node.sim.importing.jsbsim.program import Flight, Program
from sysid_node.sim.importing.jsbsim.surfaces import COMMANDS, Surface, find_surfaces, gains_to
from sysid_node.sim.importing.jsbsim.trim import SteadyFlight, default_airspeeds, find_trim, no_trim

Array = NDArray[np.float64]

#: Altitude (m) where none is given: above ground effect.
DEFAULT_ALTITUDE = 1000.0

#: Rate at which the flight control system is watched, Hz.
_WATCH_RATE = 100.0

#: JSBSim's usual rate (Hz), by which delays that are given in frames become times.
_FRAMES = 120.0

#: A table's smallest part, as a share of what each variable changes in an ordinary flight.
_SHARE = 5e-4
_ORDINARY = {"alpha": 0.1, "beta": 0.1, "p": 0.05, "q": 0.005, "r": 0.05}


@dataclass(frozen=True)
class JsbsimModel:
    """A model as read: its files, controls, steady flight, and the aircraft."""

    files: ModelFiles
    surfaces: tuple[Surface, ...]
    steady: SteadyFlight
    imported: Imported


def read_jsbsim(model: str, airspeed: float | None = None, altitude: float | None = None) -> Imported:
    """The aircraft of a JSBSim model: the path of its XML, or the name of an aircraft that comes with JSBSim.

    Coefficients are expanded about level flight at ``airspeed`` (m/s) and ``altitude`` (m). Raises InputError.
    """
    return read_model(model, airspeed, altitude).imported


def read_model(model: str, airspeed: float | None = None, altitude: float | None = None) -> JsbsimModel:
    """The same with what a flight in JSBSim itself needs."""
    files = find_model(model)
    try:
        return _read(files, airspeed, DEFAULT_ALTITUDE if altitude is None else altitude)
    except (KeyError, ValueError, RuntimeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"model {files.label}: JSBSim stops: {' '.join(str(error).split())}") from error


def _read(files: ModelFiles, airspeed: float | None, altitude: float) -> JsbsimModel:
    parts = sections(files)
    aerodynamics = [part for part in parts if part.tag == "aerodynamics"]
    systems = [part for part in parts if part.tag != "aerodynamics"]
    start = Flight(50.0, 0.03, theta=0.03, altitude=altitude, throttle=0.5)
    with tempfile.TemporaryDirectory(prefix="sysid-") as place:
        stock = Program(copy_model(files, Path(place) / "stock", ()), _WATCH_RATE)
        speeds = [airspeed] if airspeed is not None else default_airspeeds(stock, start)
        surfaces = find_surfaces(stock, aerodynamics, replace(start, airspeed=speeds[0]), _WATCH_RATE)
        if not surfaces:
            raise InputError(
                f"model {files.label}: no command moves a surface that the aerodynamics read; it must be an aeroplane"
            )
        servos = {s.name: _servo(stock, s, systems, replace(start, airspeed=speeds[0])) for s in surfaces}
        moved = {name for surface in surfaces for name in surface.properties}
        program = Program(copy_model(files, Path(place) / "driven", moved))
        steady = _steady(files, program, surfaces, [replace(start, airspeed=speed) for speed in speeds])
        surfaces = _usual_signs(program, surfaces, steady)
        steady = SteadyFlight(steady.state, {s.name: s.sign * steady.deflections[s.name] for s in surfaces})
        model = CoefficientModel(program, surfaces, steady)
        axes = model.axes(aerodynamics)
        expansion = expand(model, axes, _tolerance(model, axes))
        aircraft = _aircraft(files, program, surfaces, steady, model, expansion, servos)
        notes = [*_notes(program, surfaces, steady, model, servos), *_remainder(model, expansion, axes)]
    return JsbsimModel(files, tuple(surfaces), steady, Imported(aircraft, tuple(notes)))


def _steady(files: ModelFiles, program: Program, surfaces: Sequence[Surface], states: list[Flight]) -> SteadyFlight:
    for state in states:
        found = find_trim(program, surfaces, state)
        if found is not None:
            return found
    raise no_trim(files.name, states[0].airspeed)


def _usual_signs(program: Program, surfaces: Sequence[Surface], steady: SteadyFlight) -> list[Surface]:
    """The surfaces with the aircraft file's signs: a positive deflection pitches down, rolls and yaws left."""
    place = {"elevator": 4, "aileron": 3, "rudder": 5}

    def moment(name: str, change: float) -> float:
        driven: dict[str, float] = {}
        for surface in surfaces:
            driven |= surface.at(steady.deflections[surface.name] + (change if surface.name == name else 0.0))
        program.put(steady.state, driven)
        return float(program.loads().air[place[name]])

    return [s.flipped() if moment(s.name, 0.02) > moment(s.name, -0.02) else s for s in surfaces]


def _tolerance(model: CoefficientModel, axes: Mapping[str, Axis]) -> Array:
    """What may be left out of each coefficient (6,)."""
    sizes = {**_ORDINARY, "V": 0.1 * model.centre["V"]}
    rows = []
    for name, axis in axes.items():
        step = min(sizes.get(name, 0.1), axis.nodes[-1] - axis.centre, axis.centre - axis.nodes[0])
        step = step or sizes.get(name, 0.1)
        rows += [{**model.centre, name: axis.centre + sign * step} for sign in (-1.0, 1.0)]
    found = model({name: np.array([row[name] for row in rows]) for name in model.centre})
    return np.asarray(_SHARE * np.ptp(found, axis=0) + 1e-9)


def _servo(program: Program, surface: Surface, systems: Sequence[Element], state: Flight) -> Servo:
    """The servo of a control; ``program`` runs the model with its own flight control system."""
    chain = chain_to(surface.position, systems, COMMANDS[surface.name])
    names = [name for component in chain for name in outputs_of(component)]
    return read_servo(chain, gains_to(program, surface, names, state, _WATCH_RATE), _FRAMES)


def _aircraft(
    files: ModelFiles,
    program: Program,
    surfaces: Sequence[Surface],
    steady: SteadyFlight,
    model: CoefficientModel,
    expansion: Expansion,
    servos: Mapping[str, Servo],
) -> Aircraft:
    state = steady.state
    controls = {
        s.name: Control(s.name, CONTROL_SYMBOLS[s.name], {s.name: s.sign}, limit=min(s.limit, np.pi / 2))
        for s in surfaces
    }
    throttle = None
    if program.engines and model.thrust > 0.0:
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
        reference=Reference(state.airspeed, model.steady_loads.density),
        controls=controls,
        derivatives={name: Derivative(value) for name, value in expansion.derivatives.items()},
        throttle=throttle,
        sensors=Sensors(imu=program.named_place("eyepoint")),
        ideal=True,
        effects=_effects(model, servos, bool(throttle)),
        tables=expansion.tables,
    )


def _effects(
    model: CoefficientModel, servos: Mapping[str, Servo], powered: bool
) -> dict[str, dict[str, UncertainValue]]:
    effects: dict[str, dict[str, UncertainValue]] = {}
    for control, servo in servos.items():
        for effect, size in servo.effects().items():
            effects.setdefault(effect, {})[control] = UncertainValue(size)
    lift, moment = model.unsteady.slopes[[0, 4]]
    if lift or moment:
        terms = {"CL_alphadot": lift, "Cm_alphadot": moment}
        effects["unsteady_aerodynamics"] = {name: UncertainValue(float(value)) for name, value in terms.items()}
    return effects


def _notes(
    program: Program,
    surfaces: Sequence[Surface],
    steady: SteadyFlight,
    model: CoefficientModel,
    servos: Mapping[str, Servo],
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
    if program.cross_products > 1e-3:
        notes.append(
            f"Ixy or Iyz is {program.cross_products:.1%} of the largest moment of inertia; a file has Ixz only."
        )
    left = [
        n for n, v in zip(("CD", "CY", "Cl", "Cn"), model.unsteady.slopes[[1, 2, 3, 5]], strict=True) if abs(v) > 0.01
    ]
    if left:
        notes.append(f"Terms of {', '.join(left)} in the rate of alpha are left out; a file has those of CL and Cm.")
    if program.engines:
        notes.append(
            f"Thrust is {model.thrust:.0f} N at throttle {steady.state.throttle:.2f} and {steady.state.airspeed:.1f} "
            "m/s, and proportional to the throttle; how it changes with airspeed is in the tables over V, at this "
            "throttle. How fast engine and propeller change their speed is not held."
        )
    notes.append(
        "The IMU's place is the model's eye point, the pilot's; flow angles are those at the centre of gravity."
    )
    return notes


def _remainder(model: CoefficientModel, expansion: Expansion, axes: Mapping[str, Axis]) -> list[str]:
    """What terms of three variables leave, where it is not negligible."""
    error, size = largest_error(model, expansion, axes, 0.25, 150)
    shares = error / np.maximum(size, 1e-12)
    names = ("CL", "CD", "CY", "Cl", "Cm", "Cn")
    large = [f"{name} {share:.1%}" for name, share in zip(names, shares, strict=True) if share > 0.005]
    if not large:
        return []
    return [f"With all variables at a quarter of their range at once, derivatives and tables miss: {', '.join(large)} "
            "of the coefficient's range (terms of three variables)."]  # fmt: skip
