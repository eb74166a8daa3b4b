"""Which surfaces a pilot's command moves, found by moving it and looking what the aerodynamics read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.sim.importing.jsbsim.program import Flight, Program

Array = NDArray[np.float64]

#: The commands of the three controls, and the properties that give the control's deflection, the best first.
COMMANDS = {"elevator": "fcs/elevator-cmd-norm", "aileron": "fcs/aileron-cmd-norm", "rudder": "fcs/rudder-cmd-norm"}
_POSITIONS = {
    "elevator": ("fcs/elevator-pos-rad",),
    "aileron": ("fcs/left-aileron-pos-rad", "fcs/aileron-pos-rad", "fcs/right-aileron-pos-rad"),
    "rudder": ("fcs/rudder-pos-rad",),
}

#: How long a flight control system is left to come to rest after a command, s.
_REST = 3.0

#: How often it is left so long before the first command, until nothing moves by more than this: a throttle that lags
#: would still be on its way, and would pass for something that the command moves.
_FIRST_RESTS, _STILL = 40, 1e-9


@dataclass(frozen=True)
class JsbsimSurface:
    """One control: its deflection, and everything that the aerodynamics read as functions of it."""

    name: str
    position: str  # the property that is the control's deflection
    unit: float  # rad per unit of that property
    command: Array  # (K,) normalised, as a pilot gives it
    deflection: Array  # (K,) rad, ascending
    properties: Mapping[str, Array]  # (K,) of each property that moves along, the position among them
    feedback: bool  # whether the deflection depends on the motion, too
    sign: float = 1.0  # rad of deflection per rad of the position: -1 where JSBSim's sign is not the usual one

    def at(self, deflection: float) -> dict[str, float]:
        """The properties at a deflection (rad)."""
        return {name: float(np.interp(deflection, self.deflection, values)) for name, values in self.properties.items()}

    def flipped(self) -> JsbsimSurface:
        """The same surface with deflections of the other sign."""
        mirrored = {name: values[::-1] for name, values in self.properties.items()}
        return replace(
            self,
            command=self.command[::-1],
            deflection=-self.deflection[::-1],
            properties=mirrored,
            sign=-self.sign,
        )

    def command_for(self, deflection: float) -> float:
        """The normalised command that gives a deflection (rad)."""
        return float(np.interp(deflection, self.deflection, self.command))

    @property
    def at_rest(self) -> dict[str, float]:
        """The properties where nothing is commanded."""
        order = np.argsort(self.command, kind="stable")
        return {n: float(np.interp(0.0, self.command[order], x[order])) for n, x in self.properties.items()}

    @property
    def limit(self) -> float:
        """The largest deflection, rad."""
        return float(np.abs(self.deflection).max())


def properties_at(surfaces: Iterable[JsbsimSurface], deflections: Mapping[str, float]) -> dict[str, float]:
    """The properties of several surfaces at deflections (rad) by name.

    What two of them move, such as an elevon, is its value at rest and what each of them adds to that.
    """
    found: dict[str, float] = {}
    for surface in surfaces:
        rest: dict[str, float] | None = None
        for name, value in surface.at(deflections[surface.name]).items():
            if name in found:
                rest = surface.at_rest if rest is None else rest
                found[name] += value - rest[name]
            else:
                found[name] = value
    return found


def find_surfaces(program: Program, aerodynamics: Sequence[Element], state: Flight, rate: float) -> list[JsbsimSurface]:
    """The model's controls; ``program`` runs the model with its own flight control system at ``rate`` (Hz)."""
    read = sorted(name for name in properties_read(aerodynamics) if program.has(name))
    surfaces = []
    for name, command in COMMANDS.items():
        if not program.has(command):
            continue
        found = _probe(program, name, command, read, state, rate)
        if found is not None:
            surfaces.append(found)
    return surfaces


def gains_to(
    program: Program, surface: JsbsimSurface, names: Sequence[str], state: Flight, rate: float
) -> dict[str, float]:
    """The surface's rad per unit of each property that moves along with it, at rest."""
    command = COMMANDS[surface.name]
    known = [surface.position, *(name for name in names if name != surface.position and program.has(name))]
    low, high = (_rest(program, state, {command: share}, known, rate) for share in (-0.3, 0.3))
    moved = np.abs(high - low)
    return {n: float(moved[0] / m) * surface.unit for n, m in zip(known, moved, strict=True) if m > 1e-9}


def properties_read(aerodynamics: Sequence[Element]) -> set[str]:
    """Names of all properties of the flight control system in the aerodynamics."""
    tags = ("property", "p", "independentVar")
    texts = ((e.text or "").strip() for section in aerodynamics for e in section.iter() if e.tag in tags)
    return {text.lstrip("-") for text in texts if "fcs/" in text}


def _probe(
    program: Program, name: str, command: str, read: Sequence[str], state: Flight, rate: float
) -> JsbsimSurface | None:
    """The control of a command; None where the command moves nothing that the aerodynamics read."""
    candidates = [p for p in _POSITIONS[name] if program.has(p)]
    names = list(dict.fromkeys([*read, *candidates]))
    _come_to_rest(program, state, names, rate)
    commands = np.linspace(-1.0, 1.0, 9)
    values = np.array([_rest(program, state, {command: float(c)}, names, rate) for c in commands])
    moved = [n for n, column in zip(names, values.T, strict=True) if np.ptp(column) > 1e-6]
    seen = [n for n in moved if n in read or n in candidates]
    if not set(seen) & set(read):
        return None
    position = next((p for p in candidates if p in seen), None)
    position = position or next((n for n in seen if n.endswith("-rad")), seen[0])
    unit = math.pi / 180.0 if position.endswith("-deg") else 1.0
    columns = {n: values[:, names.index(n)] for n in seen}
    order = np.argsort(columns[position], kind="stable")
    rising = order[np.append(True, np.diff(columns[position][order]) > 1e-9)]
    at_rest, other = (_rest(program, s, {command: 0.0}, [position], rate)[0] for s in (state, _elsewhere(state)))
    deflection = columns[position][rising] * unit
    return JsbsimSurface(
        name,
        position,
        unit,
        commands[rising],
        deflection,
        {n: column[rising] for n, column in columns.items()},
        feedback=bool(abs(other - at_rest) * unit > 1e-3 * max(np.ptp(deflection), 1e-9)),
    )


def _come_to_rest(program: Program, state: Flight, names: Sequence[str], rate: float) -> None:
    """Run without commands until what lags, such as the throttle, has settled."""
    before = _rest(program, state, {}, names, rate)
    for _ in range(_FIRST_RESTS):
        after = _rest(program, state, {}, names, rate)
        if np.allclose(after, before, rtol=0.0, atol=_STILL):
            return
        before = after


def _elsewhere(state: Flight) -> Flight:
    """Another state of motion at the same place."""
    return Flight(
        1.1 * state.airspeed, state.alpha + 0.05, 0.05, (0.1, 0.05, 0.05), 0.0, state.theta, state.altitude, 0.0
    )


def _rest(program: Program, state: Flight, commands: Mapping[str, float], names: Sequence[str], rate: float) -> Array:
    """Properties after the flight control system has come to rest on commands."""
    still = {command: 0.0 for command in COMMANDS.values() if program.has(command)}
    program.put(state, {**still, **commands})
    program.step(round(_REST * rate))
    return program.read(names)
