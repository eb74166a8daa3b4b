"""What of a JSBSim model is found before its coefficients: controls, servos, masses and a steady flight."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

from sysid_node.errors import InputError
from sysid_node.sim.importing.jsbsim.actuators import JsbsimServo, chain_to, read_servo, throttle_times
from sysid_node.sim.importing.jsbsim.files import ModelFiles, copy_model, find_model, outputs_of, sections
from sysid_node.sim.importing.jsbsim.program import LEVER, Flight, Program, never_destroy_programs
from sysid_node.sim.importing.jsbsim.surfaces import COMMANDS, JsbsimSurface, find_surfaces, gains_to, properties_at
from sysid_node.sim.importing.jsbsim.trim import SteadyFlight, default_airspeeds, find_trim, no_trim

#: Altitude (m) where none is given: above ground effect.
DEFAULT_ALTITUDE = 1000.0

#: Rate at which the flight control system is watched, Hz.
_WATCH_RATE = 100.0

#: JSBSim's usual rate (Hz), by which delays that are given in frames become times.
_FRAMES = 120.0


@dataclass(frozen=True)
class ServoChain:
    """The components between a control's command and its position, by the properties that they write."""

    outputs: tuple[str, ...]  # of all components
    gains: Mapping[str, float]  # rad of the surface per unit of a property


@dataclass(frozen=True)
class ModelSurvey:
    """What is known of a model before its coefficients are expanded."""

    files: ModelFiles
    surfaces: tuple[JsbsimSurface, ...]  # with the aircraft file's signs
    steady: SteadyFlight
    servos: Mapping[str, JsbsimServo]  # by control
    chains: Mapping[str, ServoChain]  # by control
    mass: float  # kg
    inertia: Mapping[str, float]  # kg m^2
    geometry: tuple[float, float, float]  # m^2, m, m
    cg_in: tuple[float, float, float]  # in JSBSim's structural axes, inches
    engines: int
    lever_times: tuple[float, float] = (0.0, 0.0)  # lag and delay (s) before the engine, or the thrust


def survey_model(model: str, airspeed: float | None = None, altitude: float | None = None) -> ModelSurvey:
    """A model's controls, steady flight, servos and masses. Raises InputError."""
    with surveyed(model, airspeed, altitude) as (survey, _, _):
        return survey


@contextmanager
def surveyed(
    model: str, airspeed: float | None, altitude: float | None
) -> Iterator[tuple[ModelSurvey, Program, list[Element]]]:
    """A model's survey, JSBSim with its surfaces free, and its aerodynamics. Raises InputError where JSBSim stops."""
    files = find_model(model)
    try:
        with tempfile.TemporaryDirectory(prefix="sysid-") as place:
            yield _survey(files, Path(place), airspeed, DEFAULT_ALTITUDE if altitude is None else altitude)
    except (KeyError, ValueError, RuntimeError) as error:
        never_destroy_programs()
        if isinstance(error, InputError):
            raise
        raise InputError(f"model {files.label}: JSBSim stops: {' '.join(str(error).split())}") from error


def _survey(
    files: ModelFiles, place: Path, airspeed: float | None, altitude: float
) -> tuple[ModelSurvey, Program, list[Element]]:
    parts = sections(files)
    aerodynamics = [part for part in parts if part.tag == "aerodynamics"]
    systems = [part for part in parts if part.tag != "aerodynamics"]
    start = Flight(50.0, 0.03, theta=0.03, altitude=altitude, throttle=0.5)
    stock = Program(copy_model(files, place / "stock", ()), _WATCH_RATE)
    _check_sizes(files, stock)
    speeds = [airspeed] if airspeed is not None else default_airspeeds(stock, start)
    surfaces = find_surfaces(stock, aerodynamics, replace(start, airspeed=speeds[0]), _WATCH_RATE)
    if not surfaces:
        raise InputError(
            f"model {files.label}: no command moves a surface that the aerodynamics read; it must be an aeroplane"
        )
    found = {s.name: _servo(stock, s, surfaces, systems, replace(start, airspeed=speeds[0])) for s in surfaces}
    servos, chains = {n: servo for n, (servo, _) in found.items()}, {n: chain for n, (_, chain) in found.items()}
    moved = {name for surface in surfaces for name in surface.properties}
    program = Program(copy_model(files, place / "driven", moved, (LEVER,)))
    steady = _steady(files, program, surfaces, [replace(start, airspeed=speed) for speed in speeds])
    surfaces = _usual_signs(program, surfaces, steady)
    steady = SteadyFlight(steady.state, {s.name: s.sign * steady.deflections[s.name] for s in surfaces})
    cg = (program.fdm["inertia/cg-x-in"], program.fdm["inertia/cg-y-in"], program.fdm["inertia/cg-z-in"])
    survey = ModelSurvey(
        files,
        tuple(surfaces),
        steady,
        servos,
        chains,
        program.mass,
        program.inertia,
        program.geometry,
        cg,
        program.engines,
        throttle_times(systems, LEVER),
    )
    return survey, program, aerodynamics


def _check_sizes(files: ModelFiles, program: Program) -> None:
    """Raise InputError where the mass or a size is none."""
    area, span, chord = program.geometry
    sizes = {"mass": (program.mass, "kg"), "wing area": (area, "m^2"), "span": (span, "m"), "chord": (chord, "m")}
    for name, (value, unit) in sizes.items():
        if not value > 0.0:
            raise InputError(f"model {files.label}: {name} is {value:g} {unit}; it must be above zero; correct it")


def _steady(
    files: ModelFiles, program: Program, surfaces: Sequence[JsbsimSurface], states: list[Flight]
) -> SteadyFlight:
    for state in states:
        found = find_trim(program, surfaces, state)
        if found is not None:
            return found
    raise no_trim(files.name, [state.airspeed for state in states])


def _usual_signs(program: Program, surfaces: Sequence[JsbsimSurface], steady: SteadyFlight) -> list[JsbsimSurface]:
    """The surfaces with the aircraft file's signs: a positive deflection pitches down, rolls and yaws left."""
    place = {"elevator": 4, "aileron": 3, "rudder": 5}

    def moment(name: str, change: float) -> float:
        moved = {**steady.deflections, name: steady.deflections[name] + change}
        program.put(steady.state, properties_at(surfaces, moved))
        return float(program.loads().air[place[name]])

    return [s.flipped() if moment(s.name, 0.02) > moment(s.name, -0.02) else s for s in surfaces]


def _servo(
    program: Program,
    surface: JsbsimSurface,
    surfaces: Sequence[JsbsimSurface],
    systems: Sequence[Element],
    state: Flight,
) -> tuple[JsbsimServo, ServoChain]:
    """The servo of a control; ``program`` runs the model with its own flight control system."""
    own = COMMANDS[surface.name]
    others = {COMMANDS[s.name] for s in surfaces if s is not surface and surface.position in s.properties}
    chain = chain_to(surface.position, systems, own, others)
    names = [name for component in chain for name in outputs_of(component)]
    gains = gains_to(program, surface, names, state, _WATCH_RATE)
    return read_servo(chain, gains, _FRAMES), ServoChain(tuple(names), gains)
