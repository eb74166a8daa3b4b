"""An aircraft as the simulator needs it: the names that shape the program (Layout) and its numbers (Model).

Two aircraft of the same Layout share one compiled program.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import split_derivative
from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure
from sysid_node.dynamics.linear_model import level_flight
from sysid_node.dynamics.packed_tables import PackedTables, Places, pack, places_of
from sysid_node.errors import InputError

#: A scalar, or a time series of one: stations and effects work on either.
Scalar = jax.Array

#: An effect's parameters by name.
Values = Mapping[str, Scalar]


@dataclass(frozen=True)
class ParameterLayout:
    """The names of an aircraft's controls and derivatives, which shape the compiled program."""

    controls: tuple[str, ...]  # aerodynamic controls: "elevator", ...
    symbols: tuple[str, ...]  # their symbols: "de", ...
    derivatives: tuple[str, ...]  # "CL_0", ...
    tables: Places = ()  # coefficient and variables of each lookup table, after tables have been added up

    @property
    def commands(self) -> tuple[str, ...]:
        """Columns of a command: the aerodynamic controls, rad, then thrust, N."""
        return (*self.controls, "thrust")

    def terms(self, coefficient: str) -> tuple[tuple[str, str], ...]:
        """(derivative, regressor) pairs of one coefficient."""
        pairs = ((name, split_derivative(name)) for name in self.derivatives)
        return tuple((name, regressor) for name, (c, regressor) in pairs if c == coefficient)


class AircraftNumbers(NamedTuple):
    """The aircraft file's numbers, SI."""

    mass: Scalar
    inertia: Scalar  # Ixx Iyy Izz Ixz
    area: Scalar
    span: Scalar
    chord: Scalar
    airspeed: Scalar  # of the reference condition
    density: Scalar  # of the reference condition
    lift: Scalar  # CL of level flight at the reference condition
    alpha: Scalar  # angle of attack of that flight
    derivatives: Scalar  # in the layout's order
    limits: Scalar  # of the controls, rad; inf = none
    max_thrust: Scalar  # N; inf where the file gives none
    thrust_inclination: Scalar  # rad, upwards
    thrust_arm: Scalar  # nose-up moment per newton, m
    imu: Scalar  # (3,) m from the CG, FRD
    air_data: Scalar  # (3,)
    noise: Scalar  # (12,) 1 sigma of each output
    tables: PackedTables | tuple[()] = ()  # the lookup tables in the layout's order


#: What the sensors measure, in the order of ``SimulatedFlight.outputs``. Units of FlightRecord's columns.
OUTPUTS = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi", "V", "alpha", "beta")

_NOISE_OF = ("accel",) * 3 + ("gyro",) * 3 + ("attitude",) * 3 + ("airspeed", "alpha", "beta")


def layout_of(aircraft: Aircraft) -> ParameterLayout:
    """The layout of this aircraft."""
    tables = places_of(aircraft.tables)
    return ParameterLayout(tuple(aircraft.controls), aircraft.control_symbols, tuple(aircraft.derivatives), tables)


def model_of(aircraft: Aircraft) -> AircraftNumbers:
    """The numbers of this aircraft. Raises InputError where the file lacks a moment of inertia."""
    inertia = aircraft.inertia
    moments = np.array([inertia.Ixx, inertia.Iyy, inertia.Izz, inertia.Ixz])
    if not np.isfinite(moments).all():
        missing = [name for name, value in vars(inertia).items() if not np.isfinite(value)]
        raise InputError(
            f"aircraft {aircraft.name!r}: inertia without {', '.join(missing)}: simulation needs Ixx, Iyy, Izz and "
            "Ixz; complete the file"
        )
    lift, alpha = reference_flight(aircraft)
    geometry, throttle = aircraft.geometry, aircraft.throttle
    numbers: dict[str, Any] = {
        "mass": aircraft.mass,
        "inertia": moments,
        "area": geometry.S,
        "span": geometry.b,
        "chord": geometry.cbar,
        "airspeed": aircraft.reference.airspeed,
        "density": aircraft.reference.air_density,
        "lift": lift,
        "alpha": alpha,
        "derivatives": [d.value for d in aircraft.derivatives.values()],
        "limits": [math.inf if c.limit is None else c.limit for c in aircraft.controls.values()],
        "max_thrust": (throttle.max_thrust if throttle and throttle.max_thrust else math.inf),
        "thrust_inclination": throttle.inclination if throttle else 0.0,
        "thrust_arm": throttle.arm if throttle else 0.0,
        "imu": aircraft.sensors.imu,
        "air_data": aircraft.sensors.air_data,
        "noise": [aircraft.noise[name] for name in _NOISE_OF],
    }
    model = AircraftNumbers(**{name: jnp.asarray(number, dtype=float) for name, number in numbers.items()})  # type: ignore[arg-type]
    if not aircraft.tables:
        return model
    _, packed = pack(aircraft.tables)
    return model._replace(tables=PackedTables(*(jnp.asarray(part) for part in packed)))


def reference_flight(aircraft: Aircraft) -> tuple[float, float]:
    """CL and alpha (rad) of level flight at the reference condition, with thrust along the flight path."""
    pressure = dynamic_pressure(aircraft.reference.air_density, aircraft.reference.airspeed)
    lift = aircraft.mass * GRAVITY / (pressure * aircraft.geometry.S)
    values = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    alpha, _ = level_flight(values, lift, speed_ratio=1.0)
    return lift, alpha
