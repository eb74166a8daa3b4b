"""The coefficients of an aircraft in steady flight, as this package's simulator has them, and their slopes.

Derivatives, tables and all effects without a state of their own are in them. A format that holds derivatives gets the
slopes about level flight, and is held against the coefficients themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.dynamics.airflow import stability_axes, velocity_of
from sysid_node.dynamics.forces import coefficients_of
from sysid_node.dynamics.linear_model import level_flight
from sysid_node.dynamics.vector import Vector
from sysid_node.errors import InputError
from sysid_node.sim.effects import EFFECTS, cg_shift, stall_separation
from sysid_node.sim.flying.trim import trim_flight
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar, reference_flight
from sysid_node.sim.model.parameters import unpack
from sysid_node.sim.simulator import Simulator
from sysid_node.sim.stations import actuator, aerodynamics, propulsion
from sysid_node.sim.stations.airflow import Air

Array = NDArray[np.float64]
Columns = Mapping[str, Array]

#: Columns (N,) of states -> coefficients (N, 6).
Coefficients = Callable[[Columns], Array]

#: How many states are computed at once.
_BLOCK = 169

#: Half the distance of two states whose difference is a slope: rad, and non-dimensional rates.
_STEPS = {"alpha": 0.02, "beta": 0.04, "p": 0.04, "q": 0.004, "r": 0.04}
_STEP_OF_CONTROLS = 0.05

#: Stations whose effects are in the coefficients.
_STATIONS = ("actuator", "aerodynamics", "propulsion", "mass")

#: Effects of these stations that do nothing in steady flight far above the ground.
_NOT_STEADY = ("actuator_lag", "actuator_rate_limit", "actuator_backlash", "motor_lag", "unsteady_aerodynamics",
               "ground_effect")  # fmt: skip


@dataclass(frozen=True)
class SteadyModel:
    """The coefficients of an aircraft with effects; ``aircraft`` has none of its own."""

    aircraft: Aircraft
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    flight: Mapping[str, float] | None = None  # the level flight, where it is not to be this aircraft's own

    @cached_property
    def _simulator(self) -> Simulator:
        return Simulator(self.aircraft)

    @cached_property
    def acting(self) -> dict[str, Mapping[str, float]]:
        """The effects that change coefficients in steady flight."""
        return {name: values for name, values in self.effects.items()
                if EFFECTS[name].station in _STATIONS and name not in _NOT_STEADY}  # fmt: skip

    @property
    def plain(self) -> bool:
        """Whether derivatives alone give the coefficients."""
        return not self.acting and not self.aircraft.tables

    @cached_property
    def regressors(self) -> tuple[str, ...]:
        """What the formats have derivatives of."""
        return (*_STEPS, *self.aircraft.control_symbols)

    @cached_property
    def level(self) -> dict[str, float]:
        """Level flight at the reference condition: rad, m/s, throttle 0..1; zero where it is not named."""
        if self.flight is not None:
            return dict(self.flight)
        still = dict.fromkeys((*self.regressors, "throttle"), 0.0) | {"V": self.aircraft.reference.airspeed}
        values = {name: d.value for name, d in self.aircraft.derivatives.items()}
        still["alpha"], elevator = level_flight(values, reference_flight(self.aircraft)[0], speed_ratio=1.0)
        still |= {"de": elevator} if "de" in still else {}
        if self.plain:
            return still
        try:
            trim = trim_flight(self._simulator, theta=self._simulator.vector(self.acting))
        except InputError:  # none without sideslip, for example: the reference of the file stands for it
            return still
        full = self.aircraft.throttle.max_thrust if self.aircraft.throttle is not None else None
        deflections = dict(zip(self.aircraft.control_symbols, trim.command.tolist(), strict=False))
        throttle = float(np.clip(trim.command[-1] / full, 0.0, 1.0)) if full else 0.0
        return {**still, "alpha": float(trim.alpha), **deflections, "throttle": throttle}

    def states(self, **columns: Array) -> dict[str, Array]:
        """Columns (N,) of states that are level flight but for those given."""
        size = len(next(iter(columns.values())))
        return {name: columns.get(name, np.full(size, value)) for name, value in self.level.items()}

    def __call__(self, x: Columns) -> Array:
        """Coefficients (N, 6) about the centre of gravity; ``x``: rad, non-dimensional rates, V in m/s, throttle."""
        simulator = self._simulator
        theta = jnp.asarray(simulator.vector(self.acting))
        full = self.aircraft.throttle.max_thrust if self.aircraft.throttle is not None else None
        names = tuple(self.level)
        size = len(x["V"])
        rows = np.column_stack([np.broadcast_to(x[name], size) for name in names])
        whole = np.pad(rows, ((0, -size % _BLOCK), (0, 0)), "edge")  # always the same shape, so that it compiles once
        blocks = [
            _coefficients(simulator.layout, names, simulator.model, theta, jnp.asarray(block), full or 0.0)
            for block in np.split(whole, len(whole) // _BLOCK)
        ]
        found: Array = np.concatenate([np.asarray(block) for block in blocks])
        return found[:size]

    @cached_property
    def derivatives(self) -> dict[str, float]:
        """Slopes about level flight by derivative's name; the offsets make the value there that of the file."""
        value = {name: d.value for name, d in self.aircraft.derivatives.items()}
        if self.plain:
            for c in COEFFICIENTS:
                value[f"{c}_0"] = value.get(f"{c}_0", 0.0) + value.pop(f"{c}_V", 0.0)
            return value
        offset, found = self.here(self).copy(), dict[str, float]()
        for name in self.regressors:
            slope = self.slope(self, name)
            offset -= slope * self.level[name]
            found |= {f"{c}_{name}": float(s) for c, s in zip(COEFFICIENTS, slope, strict=True)}
        return {**found, **{f"{c}_0": float(o) for c, o in zip(COEFFICIENTS, offset, strict=True)}}

    def here(self, function: Coefficients) -> Array:
        """A function's coefficients (6,) in level flight."""
        return np.asarray(function(self.states(V=np.array([self.level["V"]])))[0])

    def slope(self, function: Coefficients, name: str) -> Array:
        """A function's slopes (6,) over a variable about level flight."""
        step = _STEPS.get(name, _STEP_OF_CONTROLS)
        both = self.level[name] + step * np.array([-1.0, 1.0])
        found = function(self.states(**{name: both}))
        slope = np.asarray((found[1] - found[0]) / (2.0 * step))
        return np.where(np.abs(slope) < 1e-11, 0.0, slope)

    def curve(self, alpha: Array) -> Array:
        """Coefficients (N, 6) over the angle of attack, without what all other regressors add in level flight."""
        others = [name for name in self.regressors if name != "alpha"]
        added = [[self.derivatives.get(f"{c}_{n}", 0.0) * self.level[n] for n in others] for c in COEFFICIENTS]
        return np.asarray(self(self.states(alpha=alpha)) - np.array(added).sum(axis=1))

    @property
    def bent(self) -> bool:
        """Whether lift, drag or pitching moment have a form over alpha that derivatives do not have."""
        return "stall_separation" in self.acting or "nonlinear_pitching_moment" in self.acting or any(
            "alpha" in table.over for table in self.aircraft.tables
        )  # fmt: skip


@partial(jax.jit, static_argnums=(0, 1))
def _coefficients(
    layout: ParameterLayout, names: tuple[str, ...], model: AircraftNumbers, theta: Scalar, rows: Scalar, full: float
) -> Scalar:
    """Coefficients (N, 6) of states whose columns (N, K) have these names; ``full`` is the largest thrust, N."""
    values = unpack(layout, theta)
    at = dict(zip(names, rows.T, strict=True))
    speed = at["V"]
    velocity = Vector(*velocity_of((speed, at["alpha"], at["beta"]), jnp))
    lengths = (model.span, model.chord, model.span)
    rates = Vector(*(at[n] * 2.0 * speed / length for n, length in zip("pqr", lengths, strict=True)))
    air = Air(velocity, rates, speed, at["alpha"], at["beta"], jnp.full_like(speed, model.density))
    thrust = propulsion.thrust(values, at["throttle"] * full)
    positions = jnp.stack([at[symbol] for symbol in layout.symbols], -1)
    surfaces = actuator.positions(layout, values, positions, jnp.zeros(()))  # a failure that comes later is none yet
    surfaces = actuator.effective(layout, values, surfaces, jnp.zeros(()))
    bent = aerodynamics.deflections(layout, model, values, surfaces, air, thrust)
    regressors = aerodynamics.regressors_of(layout, model, air, bent, at["throttle"])
    zero = jnp.zeros_like(speed)
    attached = stall_separation.attached(values["stall_separation"], air.alpha, zero, zero)
    found = aerodynamics.coefficients(layout, model, values, regressors, attached, zero)
    force, moment = aerodynamics.load(model, air, found)
    moment = moment.minus(cg_shift.shift(values["cg_shift"]).cross(force))
    scale = air.pressure * model.area
    reduced = coefficients_of(force, moment, stability_axes(velocity, jnp), scale, model.span, model.chord)
    return jnp.stack([jnp.broadcast_to(part, speed.shape) for part in reduced], -1)
