"""A model of another simulator as its equations have it, its level flight, and the aircraft file of both.

``Plant`` is what a reader writes down: masses, sizes, controls and the loads in any state. ``aircraft_of`` finds the
level flight, expands the coefficients about it (``expansion``) and fills an ``Aircraft``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from sysid_node.aircraft.model import (
    Aircraft,
    Control,
    Derivative,
    Geometry,
    Inertia,
    ReferenceCondition,
    Throttle,
    UncertainValue,
)
from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.errors import InputError
from sysid_node.sim.importing.expansion import TableAxis, expand

Array = NDArray[np.float64]

#: Smallest part of a coefficient that becomes a derivative or a table.
_TOLERANCE = np.full(6, 1e-7)

#: Throttles of the tables; close together near zero, where a rotor's speed grows as the root of its thrust.
_THROTTLES = (0.0, 0.0025, 0.01, 0.0225, *np.linspace(0.05, 1.0, 20))

#: Lift coefficients of the airspeeds that are tried where none is given.
_LIFTS = (0.4, 0.25, 0.6, 0.9, 0.15)


@dataclass(frozen=True)
class PlantStates:
    """N states of flight in still air: m/s, rad, rad/s; controls by symbol (rad); throttle 0..1. Each (N,)."""

    airspeed: Array
    alpha: Array
    beta: Array
    p: Array
    q: Array
    r: Array
    controls: Mapping[str, Array]
    throttle: Array


#: Force (N) and moment about the centre of gravity (N m), body axes forward-right-down, (N, 6).
LoadFunction = Callable[[PlantStates], Array]


@dataclass(frozen=True)
class PlantEngine:
    """The engine of another simulator's model, and the joint that carries the throttle."""

    loads: LoadFunction
    joint: str = "throttle"
    full_thrust: float | None = None  # N, where thrust is proportional to the throttle


@dataclass(frozen=True)
class Plant:
    """Another simulator's model, SI; ``air`` are its aerodynamic loads at the air's ``density`` (kg/m^3)."""

    name: str
    source: str
    mass: float
    inertia: Inertia
    geometry: Geometry
    density: float
    controls: Mapping[str, Control]
    air: LoadFunction
    engine: PlantEngine | None
    nodes: Mapping[str, Array]  # of alpha and beta, and where a model has kinks
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class LevelFlight:
    """A level flight: airspeed (m/s), angles (rad), deflections by symbol (rad), throttle 0..1."""

    airspeed: float
    alpha: float
    phi: float
    deflections: Mapping[str, float]
    throttle: float


def aircraft_of(plant: Plant, airspeed: float | None) -> tuple[Aircraft, LevelFlight]:
    """The aircraft, ``ideal``, with its coefficients about level flight. Raises InputError where there is none."""
    level = _level_flight(plant, airspeed)
    at = _states(level)
    thrust = _engine(plant, at)[0]
    size = float(np.hypot(thrust[0], thrust[2]))
    throttle = None
    if plant.engine is not None and size > 0.0 and level.throttle > 0.0:
        inclination = float(np.arctan2(-thrust[2], thrust[0]))
        full = plant.engine.full_thrust or size / level.throttle
        throttle = Throttle(plant.engine.joint, full, inclination, float(thrust[4]) / size)
    steady = np.array([thrust[0], 0.0, thrust[2], 0.0, thrust[4], 0.0]) if throttle else np.zeros(6)

    def coefficients(points: Mapping[str, Array]) -> Array:
        """All loads but a thrust in proportion to the throttle."""
        states = _states_of(plant, points, level.throttle)
        share = states.throttle / (level.throttle or 1.0)
        load = plant.air(states) + _engine(plant, states) - np.outer(share, steady)
        return nondimensional(load, plant.density, states, plant.geometry)

    expansion = expand(coefficients, _axes(plant, level, powered=throttle is not None), _TOLERANCE)
    aircraft = Aircraft(
        name=plant.name,
        source=f"{plant.source}; about level flight at {level.airspeed:.2f} m/s, alpha {level.alpha:.4f} rad",
        mass=plant.mass,
        inertia=plant.inertia,
        geometry=plant.geometry,
        reference=ReferenceCondition(level.airspeed, plant.density),
        controls=dict(plant.controls),
        derivatives={name: Derivative(value) for name, value in expansion.derivatives.items()},
        throttle=throttle,
        ideal=True,
        effects={name: {k: UncertainValue(v) for k, v in values.items()} for name, values in plant.effects.items()},
        tables=expansion.tables,
    )
    return aircraft, level


def nondimensional(load: Array, density: float, states: PlantStates, geometry: Geometry) -> Array:
    """CL, CD, CY, Cl, Cm, Cn (N, 6) of forces and moments in body axes."""
    X, Y, Z, L, M, N = (load / (0.5 * density * states.airspeed**2 * geometry.S)[:, None]).T
    cos, sin = np.cos(states.alpha), np.sin(states.alpha)
    moments = (L / geometry.b, M / geometry.cbar, N / geometry.b)
    return np.column_stack([X * sin - Z * cos, -X * cos - Z * sin, Y, *moments])


def _engine(plant: Plant, states: PlantStates) -> Array:
    return np.zeros((len(states.airspeed), 6)) if plant.engine is None else plant.engine.loads(states)


def _states(level: LevelFlight) -> PlantStates:
    one = np.ones(1)
    controls = {symbol: value * one for symbol, value in level.deflections.items()}
    still = 0.0 * one
    return PlantStates(
        level.airspeed * one, level.alpha * one, still, still, still, still, controls, level.throttle * one
    )


def _states_of(plant: Plant, points: Mapping[str, Array], throttle: float) -> PlantStates:
    """States from columns of regressors; rates there are non-dimensional."""
    speed = points["V"]
    p, r = (points[name] * 2.0 * speed / plant.geometry.b for name in "pr")
    q = points["q"] * 2.0 * speed / plant.geometry.cbar
    controls = {control.symbol: points[control.symbol] for control in plant.controls.values()}
    lever = points.get("throttle", np.full_like(speed, throttle))
    return PlantStates(speed, points["alpha"], points["beta"], p, q, r, controls, lever)


def _axes(plant: Plant, level: LevelFlight, *, powered: bool) -> dict[str, TableAxis]:
    alpha, beta = plant.nodes["alpha"], plant.nodes["beta"]
    axes = {"alpha": TableAxis.of(alpha, level.alpha, 1e-3), "beta": TableAxis.of(beta, 0.0, 1e-3)}
    for name, size in (("p", 0.15), ("q", 0.03), ("r", 0.15)):
        axes[name] = TableAxis.of(size * np.linspace(-1.0, 1.0, 5), 0.0, 0.01 * size)
    speeds = level.airspeed * np.array([0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2, 1.35, 1.5])
    axes["V"] = TableAxis.of(speeds, level.airspeed, 0.01)
    if powered:
        axes["throttle"] = TableAxis.of(np.array(_THROTTLES), level.throttle, 0.01)
    for control in plant.controls.values():
        limit = control.limit or 0.5
        nodes = plant.nodes.get(control.symbol, limit * np.linspace(-1.0, 1.0, 5))
        axes[control.symbol] = TableAxis.of(nodes, level.deflections[control.symbol], 1e-3)
    return axes


def _level_flight(plant: Plant, airspeed: float | None) -> LevelFlight:
    speeds = [airspeed] if airspeed is not None else [_speed_at(plant, lift) for lift in _LIFTS]
    for speed in speeds:
        found = _balance(plant, speed)
        if found is not None:
            return found
    told = " or ".join(f"{speed:.1f}" for speed in sorted(speeds))
    raise InputError(
        f"model {plant.name!r}: no level flight at {told} m/s that its controls and throttle can hold; "
        "give another --airspeed"
    )


def _speed_at(plant: Plant, lift: float) -> float:
    return float(np.sqrt(2.0 * plant.mass * GRAVITY / (plant.density * plant.geometry.S * lift)))


#: Forces and moments that no aircraft near level flight has, in its weights, and in these times its chord.
_LARGEST = 1e6


def _balance(plant: Plant, speed: float) -> LevelFlight | None:
    """The level flight at an airspeed (a glide where there is no engine), without sideslip; None without one."""
    names = [n for n in ("elevator", "aileron", "rudder") if n in plant.controls]
    used = [plant.controls[name] for name in names]
    still = {control.symbol: 0.0 for control in plant.controls.values()}
    powered = plant.engine is not None

    def flight(z: Array) -> tuple[LevelFlight, float]:
        deflections = still | {c.symbol: float(x) for c, x in zip(used, z[3:], strict=False)}
        level = LevelFlight(speed, float(z[0]), float(z[1]), deflections, float(z[2]) if powered else 0.0)
        return level, float(z[0]) if powered else float(z[2])

    def residual(z: Array) -> Array:
        level, theta = flight(z)
        states = _states(level)
        load = (plant.air(states) + _engine(plant, states))[0]
        cos = np.cos(theta)
        down = np.array([-np.sin(theta), np.sin(level.phi) * cos, np.cos(level.phi) * cos])
        weight = plant.mass * GRAVITY
        return np.concatenate([load[:3] / weight + down, load[3:] / (weight * plant.geometry.cbar)])

    limits = [c.limit or 0.6 for c in used]
    lower = np.array([-0.25, -0.3, 0.0 if powered else -0.6, *(-x for x in limits)])
    upper = np.array([0.35, 0.3, 1.0 if powered else 0.5, *limits])
    start = np.array([0.06, 0.0, 0.4 if powered else 0.0, *(0.0 for _ in used)])
    moved = start + 0.01 * (upper - start)
    if not all(np.abs(residual(point)).max() < _LARGEST for point in (start, moved)):  # nor where one is not finite
        raise InputError(
            f"model {plant.name!r}: at {speed:.1f} m/s its forces are over {_LARGEST:g} weights; correct it"
        )
    found = least_squares(residual, start, bounds=(lower, upper), x_scale=0.1, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return flight(found.x)[0] if np.abs(found.fun).max() < 1e-6 else None
