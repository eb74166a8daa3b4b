"""A JSBSim model's coefficients as a function of its regressors, and where its own tables have their points."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.names import CONTROL_SYMBOLS
from sysid_node.sim.importing.expansion import TableAxis
from sysid_node.sim.importing.jsbsim.program import LEVER, Loads, Program
from sysid_node.sim.importing.jsbsim.surfaces import JsbsimSurface, properties_at
from sysid_node.sim.importing.jsbsim.throttle import engine_of
from sysid_node.sim.importing.jsbsim.trim import SteadyFlight

Array = NDArray[np.float64]

#: Nodes about the steady flight, beside those of the model's own tables: rad, and non-dimensional rates.
_ALPHA = np.deg2rad(np.arange(-16.0, 26.1, 2.0))
_BETA = np.deg2rad([-20.0, -15.0, -10.0, -5.0, -2.5, 0.0, 2.5, 5.0, 10.0, 15.0, 20.0])
_RATES = {"p": 0.2, "q": 0.04, "r": 0.2}
_SPEEDS = (0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2, 1.3, 1.4)
_THROTTLES = np.linspace(0.0, 1.0, 21)
_LARGEST = {"alpha": (-0.35, 0.6), "beta": (-0.44, 0.44)}


@dataclass(frozen=True)
class UnsteadyTerms:
    """What the rate of the angle of attack adds: coefficients (6,) per dalpha/dt cbar / 2V."""

    slopes: Array


class CoefficientModel:
    """The model near one steady flight; ``program`` runs it with surfaces that the caller sets."""

    def __init__(self, program: Program, surfaces: Sequence[JsbsimSurface], steady: SteadyFlight) -> None:
        self._program, self._steady = program, steady
        self._surfaces = {CONTROL_SYMBOLS[s.name]: s for s in surfaces}
        self._area, self._span, self._chord = program.geometry
        self.thrust = 0.0
        self._put({}, steady.state.phi)
        self.steady_loads: Loads = program.loads()
        self.mach_per_speed = program.mach / steady.state.airspeed
        engine = engine_of(program, steady.state, self.steady_loads.engine)
        self.thrust, self.inclination = engine.thrust, engine.inclination
        self.arm, self.throttle_delay, self.motor_lag = engine.arm, engine.delay, engine.lag
        self.unsteady = self._unsteady()

    @property
    def centre(self) -> dict[str, float]:
        """The steady flight's regressors."""
        state = self._steady.state
        angles = {"alpha": state.alpha, "beta": state.beta, "p": 0.0, "q": 0.0, "r": 0.0, "V": state.airspeed}
        angles |= {"throttle": state.throttle} if self.thrust else {}
        return {**angles, **{symbol: self._steady.deflections[s.name] for symbol, s in self._surfaces.items()}}

    def __call__(self, points: Mapping[str, Array]) -> Array:
        """Coefficients (N, 6): all loads but a thrust in proportion to the throttle, and no terms in alpha's rate."""
        size = len(next(iter(points.values())))
        names = list(points)
        rows = np.column_stack([points[name] for name in names])
        result = np.empty((size, 6))
        for i, row in enumerate(rows.tolist()):
            at = dict(zip(names, row, strict=True))
            self._put(at, self._steady.state.phi)
            result[i] = self._reduced(self._program.loads(), at)
        return result

    def _put(self, at: Mapping[str, float], phi: float) -> None:
        full = {**self.centre, **at}
        half = 2.0 * full["V"]
        rates = (full["p"] * half / self._span, full["q"] * half / self._chord, full["r"] * half / self._span)
        deflections = {surface.name: full[symbol] for symbol, surface in self._surfaces.items()}
        # theta is the steady flight's: gravity's direction does not matter for the loads, once dalpha/dt is known
        state = replace(
            self._steady.state,
            airspeed=full["V"],
            alpha=full["alpha"],
            beta=full["beta"],
            rates=rates,
            phi=phi,
            throttle=full.get("throttle", self._steady.state.throttle),
        )
        self._program.put(state, properties_at(self._surfaces.values(), deflections))

    def _reduced(self, loads: Loads, at: Mapping[str, float]) -> Array:
        lever = at.get("throttle", self._steady.state.throttle) / (self._steady.state.throttle or 1.0)
        thrust = (
            self.thrust
            * lever
            * np.array([math.cos(self.inclination), 0.0, -math.sin(self.inclination), 0.0, self.arm, 0.0])
        )
        speed = at.get("V", self._steady.state.airspeed)
        alpha = at.get("alpha", self._steady.state.alpha)
        total = self._nondimensional(loads.air + loads.engine - thrust, loads.density, speed, alpha)
        return total - self.unsteady.slopes * loads.alpha_rate * self._chord / (2.0 * speed)

    def _nondimensional(self, load: Array, density: float, speed: float, alpha: float) -> Array:
        """CL, CD, CY, Cl, Cm, Cn of a force and moment in body axes."""
        scale = 0.5 * density * speed**2 * self._area
        X, Y, Z, L, M, N = load / scale
        cos, sin = math.cos(alpha), math.sin(alpha)
        moments = (L / self._span, M / self._chord, N / self._span)
        return np.array([X * sin - Z * cos, -X * cos - Z * sin, Y, *moments])

    def _unsteady(self) -> UnsteadyTerms:
        """From the same flow upright and inverted: gravity alone changes the rate of alpha."""
        state = self._steady.state
        found = []
        for phi in (0.0, math.pi):
            self._put({}, phi)
            loads = self._program.loads()
            air = self._nondimensional(loads.air, loads.density, state.airspeed, state.alpha)
            found.append((loads.alpha_rate * self._chord / (2.0 * state.airspeed), air))
        (rate0, air0), (rate1, air1) = found
        if abs(rate1 - rate0) < 1e-9:
            return UnsteadyTerms(np.zeros(6))
        slopes = (air1 - air0) / (rate1 - rate0)
        return UnsteadyTerms(np.where(np.abs(slopes) > 1e-4, slopes, 0.0))

    def axes(self, aerodynamics: Sequence[Element]) -> dict[str, TableAxis]:
        """The variables with their nodes: regular ones, and the points of the model's tables."""
        points_of_tables = self._points_of_tables(aerodynamics)
        centre, speed = self.centre, self._steady.state.airspeed
        axes = {}
        for name, regular in (("alpha", _ALPHA), ("beta", _BETA)):
            low, high = _LARGEST[name]
            points = [x for x in points_of_tables.get(name, []) if low <= x <= high]
            axes[name] = TableAxis.of([*regular, *points], centre[name], 0.004)
        for name, size in _RATES.items():
            points = [x for x in points_of_tables.get(name, []) if abs(x) <= 2.0 * size]
            axes[name] = TableAxis.of([*(size * np.array([-1.0, -0.5, 0.0, 0.5, 1.0])), *points], 0.0, 0.1 * size)
        if "throttle" in centre:
            levers = [x for x in points_of_tables.get("throttle", []) if 0.0 <= x <= 1.0]
            axes["throttle"] = TableAxis.of([*_THROTTLES, *levers], centre["throttle"], 0.02)
        speeds = [x for x in points_of_tables.get("V", []) if 0.6 * speed <= x <= 1.4 * speed]
        axes["V"] = TableAxis.of([*(speed * np.array(_SPEEDS)), *speeds], speed, 0.01 * speed)
        for symbol, surface in self._surfaces.items():
            low, high = float(surface.deflection[0]), float(surface.deflection[-1])
            points = [x for x in points_of_tables.get(symbol, []) if low <= x <= high]
            middle = 0.0 if low < 0.0 < high else 0.5 * (low + high)
            regular = np.concatenate([np.linspace(low, middle, 4), np.linspace(middle, high, 4)])
            axes[symbol] = TableAxis.of(
                [*regular, *points], float(np.clip(centre[symbol], low, high)), 0.01 * (high - low)
            )
        return axes

    def _points_of_tables(self, aerodynamics: Sequence[Element]) -> dict[str, list[float]]:
        """By variable the points of the model's tables over it."""
        degree = math.pi / 180.0
        meaning = {
            "aero/alpha-rad": ("alpha", 1.0),
            "aero/alpha-deg": ("alpha", degree),
            "aero/beta-rad": ("beta", 1.0),
            "aero/beta-deg": ("beta", degree),
            "velocities/mach": ("V", 1.0 / max(self.mach_per_speed, 1e-9)),
            LEVER: ("throttle", 1.0),
            **{f"aero/reduced/{rate}": (rate, 1.0) for rate in _RATES},  # sim.export.jsbsim writes such models
            "fcs/throttle-lagged-norm": ("throttle", 1.0),
            **{s.position: (symbol, s.sign * s.unit) for symbol, s in self._surfaces.items()},
        }
        points: dict[str, list[float]] = {}
        for section in aerodynamics:
            for table in section.iter("table"):
                for name, values in table_points(table):
                    if name in meaning:
                        axis, unit = meaning[name]
                        points.setdefault(axis, []).extend(unit * value for value in values)
        return points


def table_points(table: Element) -> list[tuple[str, list[float]]]:
    """(property, points) of each variable of a JSBSim table; what is not numbers is left out."""
    variables = {v.get("lookup", "row"): (v.text or "").strip() for v in table.findall("independentVar")}
    found = []
    blocks = [
        [line.split() for line in (d.text or "").splitlines() if line.split()] for d in table.findall("tableData")
    ]
    try:
        for block in blocks:
            lines = block[1:] if "column" in variables else block
            if "column" in variables:
                found.append((variables["column"], [float(x) for x in block[0]]))
            if "row" in variables:
                found.append((variables["row"], [float(line[0]) for line in lines]))
        if "table" in variables:
            found.append((variables["table"], [float(d.get("breakPoint", "nan")) for d in table.findall("tableData")]))
    except (ValueError, IndexError):
        return []
    return found
