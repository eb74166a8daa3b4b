"""Short flights in JSBSim itself, each from a given state, with given commands and motion of the air."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.airflow import flow_angles
from sysid_node.dynamics.attitude import euler_angles
from sysid_node.errors import InputError
from sysid_node.sim.importing.jsbsim.files import ModelFiles, copy_model
from sysid_node.sim.importing.jsbsim.program import FOOT, POUND, SLUG, Flight, Program
from sysid_node.sim.importing.jsbsim.surfaces import COMMANDS, JsbsimSurface, properties_at
from sysid_node.sim.importing.jsbsim.survey import ModelSurvey

Array = NDArray[np.float64]

#: JSBSim's frames a second, at least: below 400 Hz its answers drift.
FRAME_RATE = 400.0

#: How long before a short flight the flight control system follows the commands, s: longer than lags and delays last.
_WARM_UP = 1.0

_READ = (
    *(f"forces/fb{axis}-total-lbs" for axis in "xyz"),
    *(f"accelerations/{axis}dot-rad_sec2" for axis in "pqr"),
    *(f"velocities/{axis}-rad_sec" for axis in "pqr"),
    *(f"attitude/{angle}-rad" for angle in ("phi", "theta", "psi")),
    *(f"velocities/{axis}-aero-fps" for axis in "uvw"),
)


@dataclass(frozen=True)
class ShortFlights:
    """What short flights are flown with: N samples at a constant rate, body axes forward-right-down.

    The state is used where a short flight begins. ``air`` is the velocity of the air since then.
    """

    rate: float  # Hz
    begins: NDArray[np.bool_]  # (N,)
    velocity: Array  # (N, 3) m/s, relative to the air
    attitude: Array  # (N, 3) roll, pitch, heading, rad
    rates: Array  # (N, 3) rad/s
    commands: Array  # (N, controls + 1) rad, thrust in N
    air: Array  # (N, 3) m/s
    altitude: Array  # (N,) m


@dataclass(frozen=True)
class FlownMotion:
    """The motion at the centre of gravity, N samples; NaN where JSBSim could not go on."""

    force: Array  # (N, 3) specific force, m/s^2
    turning: Array  # (N, 3) rad/s^2
    rates: Array  # (N, 3) rad/s
    attitude: Array  # (N, 3) roll, pitch, heading, rad
    velocity: Array  # (N, 3) m/s, relative to the air


class JsbsimFlyer:
    """One JSBSim model that flies short flights of an aircraft file's commands.

    ``survey`` is that of the model as it was: it says which command gives which deflection. A control whose position
    depends on the motion is held at its recorded position. JSBSim runs ``frame_rate`` frames a second, or one a sample.
    Raises InputError where JSBSim does not load the model.
    """

    def __init__(
        self,
        survey: ModelSurvey,
        files: ModelFiles,
        aircraft: Aircraft,
        rate: float,
        frame_rate: float = FRAME_RATE,
    ) -> None:
        self._frames = max(round(frame_rate / rate), 1)
        self._survey, self._names = survey, tuple(aircraft.controls)
        self._surfaces = {surface.name: surface for surface in survey.surfaces}
        self._held = _held(survey.surfaces)
        held = {name for s in self._held for name in s.properties}
        with tempfile.TemporaryDirectory(prefix="sysid-") as place:
            self.program = Program(copy_model(files, Path(place), held), rate * self._frames)
        bias = aircraft.effect_values().get("actuator_bias", {})
        self._offsets = {name: bias.get(name, 0.0) for name in self._names}
        throttle = aircraft.throttle
        self._full = (throttle.max_thrust or 1.0) if throttle else 0.0

    def fly_short(self, begins: Array, body: Array, commands: Array, air: Array, rate: float) -> FlownMotion:
        """Short flights from the states (N, 13) of ``sim.model.state.STATES`` where ``begins`` (N,) is true.

        ``commands`` (N, controls + 1) are rad and N, ``air`` (N, 3) m/s along body axes, ``rate`` is in Hz.
        """
        attitude = np.column_stack(euler_angles(tuple(body[:, 6:10].T), np))
        parts = (body[:, 3:6], attitude, body[:, 10:13], commands, air, -body[:, 2])
        return self.fly(ShortFlights(rate, np.asarray(begins, bool), *parts))

    def fly(self, flights: ShortFlights) -> FlownMotion:
        """The short flights, one after the other."""
        count = len(flights.begins)
        rows = np.full((count, 15), np.nan)
        edges = [*np.flatnonzero(flights.begins).tolist(), count]
        for first, last in pairwise(edges):
            try:
                rows[first:last] = self._one(flights, first, last)
            except (RuntimeError, ValueError) as error:
                if isinstance(error, InputError):
                    raise
        return FlownMotion(*(rows[:, k : k + 3] for k in range(0, 15, 3)))

    def _one(self, flights: ShortFlights, first: int, last: int) -> Array:
        """Rows (last - first, 15) of one short flight."""
        program, fdm = self.program, self.program.fdm
        self._still_air()
        before = max(first - round(_WARM_UP * flights.rate), 0)
        # JSBSim has no way to set an engine's speed: it begins at the steady one of the throttle's recent mean
        recent = flights.commands[before : first + 1].mean(axis=0)
        program.put(_state(flights, first, self._share(recent)), self._driven(recent))
        program.suspend()
        for k in range(before, first):
            for row in self._between(flights.commands[k], flights.commands[k + 1]):
                program.drive(self._driven(row))
                fdm.run()
        program.drive(self._driven(flights.commands[first]))
        fdm.run()
        program.resume()
        rows = np.empty((last - first, 15))
        rows[0] = self._read()
        for k in range(first, last - 1):
            between = zip(self._between(flights.commands[k], flights.commands[k + 1]),
                          self._between(flights.air[k], flights.air[k + 1]), strict=True)  # fmt: skip
            for command, air in between:
                program.drive(self._driven(command))
                self._blow(air)
                fdm.run()
            rows[k + 1 - first] = self._read()
        return rows

    def _between(self, a: Array, b: Array) -> Array:
        """Rows (frames, ...) on the line from a to b, b the last."""
        share = np.arange(1, self._frames + 1)[:, None] / self._frames
        return np.asarray(a + share * (b - a))

    def _share(self, command: Array) -> float:
        return float(np.clip(command[-1] / self._full, 0.0, 1.0)) if self._full else 0.0

    def _driven(self, command: Array) -> dict[str, float]:
        """Properties that give a command (controls + 1,)."""
        given = dict(zip(self._names, command.tolist(), strict=False))
        given = {name: value + self._offsets[name] for name, value in given.items() if name in self._surfaces}
        held = [s for s in self._held if s.name in given]
        driven = properties_at(held, given)
        for name in given.keys() - {s.name for s in held}:
            driven[COMMANDS[name]] = self._surfaces[name].command_for(given[name])
        share = self._share(command)
        for i in range(max(self._survey.engines, 1)):
            if self.program.has(f"fcs/throttle-cmd-norm[{i}]"):
                driven[f"fcs/throttle-cmd-norm[{i}]"] = share
        return driven

    def _still_air(self) -> None:
        self.program.drive({f"atmosphere/gust-{way}-fps": 0.0 for way in ("north", "east", "down")})

    def _blow(self, air: Array) -> None:
        """Moves the air at a velocity (3,) along the aircraft's axes of this moment."""
        fdm = self.program.fdm
        phi, theta, psi = (float(fdm[f"attitude/{angle}-rad"]) for angle in ("phi", "theta", "psi"))
        north, east, down = (_rotation(phi, theta, psi) @ air / FOOT).tolist()
        self.program.drive({"atmosphere/gust-north-fps": north, "atmosphere/gust-east-fps": east,
                            "atmosphere/gust-down-fps": down})  # fmt: skip

    def _read(self) -> Array:
        row = self.program.read(_READ)
        row[:3] *= POUND / (float(self.program.fdm["inertia/mass-slugs"]) * SLUG)
        row[12:] *= FOOT
        return row


def _state(flights: ShortFlights, place: int, throttle: float) -> Flight:
    speed, alpha, beta = (float(x) for x in flow_angles(flights.velocity[place], np))
    phi, theta, _ = flights.attitude[place].tolist()
    p, q, r = flights.rates[place].tolist()
    return Flight(speed, alpha, beta, (p, q, r), phi, theta, float(flights.altitude[place]), throttle)


def _held(surfaces: Sequence[JsbsimSurface]) -> list[JsbsimSurface]:
    """The controls whose positions are set: those that depend on the motion, and those that move what these move."""
    names = {name for s in surfaces if s.feedback for name in s.properties}
    while more := {n for s in surfaces if names & set(s.properties) for n in s.properties} - names:
        names |= more
    return [s for s in surfaces if s.feedback or names & set(s.properties)]


def _rotation(phi: float, theta: float, psi: float) -> Array:
    """Body axes to north, east, down (3, 3)."""
    (sp, st, ss), (cp, ct, cs) = np.sin([phi, theta, psi]), np.cos([phi, theta, psi])
    return np.array(
        [
            [ct * cs, sp * st * cs - cp * ss, cp * st * cs + sp * ss],
            [ct * ss, sp * st * ss + cp * cs, cp * st * ss - sp * cs],
            [-st, sp * ct, cp * ct],
        ]
    )
