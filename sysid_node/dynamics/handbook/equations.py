"""The equations of motion of an aircraft file: derivatives, tables, and the steady separation of flow at the stall.

The terms in the rate of alpha are included, too. Effects on servos, delays and instruments do not change them; further
effects of a file are left out, and ``left_out`` names them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft, Inertia
from sysid_node.dynamics.airflow import flow_rates, velocity_of
from sysid_node.dynamics.atmosphere import dynamic_pressure, speed_of_sound
from sysid_node.dynamics.attitude import down_of_euler, euler_rates
from sysid_node.dynamics.coefficients import Coefficients, linear_coefficient, with_polar
from sysid_node.dynamics.forces import force_and_moment, thrust_axes, thrust_line
from sysid_node.dynamics.lookup import interpolate
from sysid_node.dynamics.packed_tables import PackedTables, Places, coefficients_of, pack, variables_of
from sysid_node.dynamics.rigid_body import angular_acceleration, velocity_rate
from sysid_node.dynamics.tables import full_thrust
from sysid_node.dynamics.vector import Real, Vector

Array = NDArray[np.float64]

#: States of ``Equations.rates``: m/s, rad, rad/s.
STATES = ("V", "alpha", "q", "theta", "beta", "p", "r", "phi")

#: Parameters of ``stall_separation`` that a file need not state, as the simulator has them.
_STALL = {"depth": 0.0, "alpha_star": 0.26, "a1": 20.0, "CD_X": 0.1, "Cm_X": -0.05}

#: Effects that are part of the steady forces here; servos and stamps do not change a steady flight.
_INCLUDED = frozenset({"stall_separation", "lateral_asymmetry", "unsteady_aerodynamics"})


class Equations:
    """The steady aerodynamics and the six degrees of freedom of one aircraft at its reference air density."""

    def __init__(self, aircraft: Aircraft) -> None:
        self.aircraft = aircraft
        self.density = aircraft.reference.air_density
        self.stall = _stall_values(aircraft)

    @cached_property
    def left_out(self) -> tuple[str, ...]:
        """Effects of the file that act on forces or motion and are not part of these equations."""
        silent = ("imu_", "vane_", "air", "sensor_", "actuator_", "command_", "motor_")
        return tuple(name for name in self.aircraft.effects if name not in _INCLUDED and not name.startswith(silent))

    def coefficients(self, **state: Real) -> Coefficients:
        """All six coefficients. ``state``: V (m/s), alpha, beta, controls' symbols (rad), p, q, r non-dimensional.

        Tables over the throttle (0..1) count where it is given.
        """
        x: dict[str, Real] = dict.fromkeys(("alpha", "beta", "p", "q", "r", *self.aircraft.control_symbols), 0.0)
        x |= state
        speed = x.pop("V", self.aircraft.reference.airspeed)
        x |= {"0": 1.0, "V": speed / self.aircraft.reference.airspeed}
        added = self._added({**x, "V": speed, "Mach": speed / speed_of_sound(self.density, np)})
        attached = 0.5 * (1.0 - np.tanh(self.stall["a1"] * (x["alpha"] - self.stall["alpha_star"])))
        lift = self._sum("CL", x, added) * _kirchhoff(attached, self.stall["depth"])
        x = with_polar(x, lift)
        lost = self.stall["depth"] * (1.0 - attached)
        offset = self.aircraft.effect_values().get("lateral_asymmetry", {})
        return Coefficients(
            CL=lift,
            CD=self._sum("CD", x, added) + lost * self.stall["CD_X"],
            CY=self._sum("CY", x, added) + offset.get("CY_0", 0.0),
            Cl=self._sum("Cl", x, added) + offset.get("Cl_0", 0.0),
            Cm=self._sum("Cm", x, added) + lost * self.stall["Cm_X"],
            Cn=self._sum("Cn", x, added) + offset.get("Cn_0", 0.0),
        )

    def _sum(self, coefficient: str, x: Mapping[str, Real], added: Mapping[str, Real]) -> Real:
        names = self.aircraft.model_structure.get(coefficient, ())
        terms = ((self.aircraft.derivatives[f"{coefficient}_{name}"].value, name) for name in names)
        return linear_coefficient(terms, x) + added.get(coefficient, 0.0)

    def _added(self, x: Mapping[str, Real]) -> dict[str, Real]:
        """What the tables add to each coefficient that has any; those over the throttle where it is given."""
        packed = self._tables["throttle" in x]
        if packed is None:
            return {}
        places, tables = packed
        at = np.stack(np.broadcast_arrays(*(x[name] for name in variables_of(places))), -1)
        return dict(zip(coefficients_of(places), np.moveaxis(interpolate(places, tables, at, np), -1, 0), strict=True))

    @cached_property
    def _tables(self) -> tuple[tuple[Places, PackedTables] | None, tuple[Places, PackedTables] | None]:
        """All tables in one; without and with those over the throttle."""
        every = self.aircraft.tables
        chosen = ([table for table in every if "throttle" not in table.over], every)
        without, of_all = (pack(tables) if tables else None for tables in chosen)
        return without, of_all

    def rates(self, state: Array, controls: Mapping[str, float], thrust: float) -> Array:
        """Rates (8,) of ``STATES`` with controls (rad, by symbol) and thrust (N) held."""
        V, alpha, q, theta, beta, p, r, phi = state
        geometry, turning = self.aircraft.geometry, Vector(p, q, r)
        span, chord = geometry.b / (2.0 * V), geometry.cbar / (2.0 * V)
        throttle = thrust / full_thrust(self.aircraft)
        c = self.coefficients(
            V=V, alpha=alpha, beta=beta, p=p * span, q=q * chord, r=r * span, throttle=throttle, **controls
        )
        area = dynamic_pressure(self.density, V) * geometry.S
        force, moment = force_and_moment(c, (np.cos(alpha), np.sin(alpha)), area, geometry.b, geometry.cbar)
        inclination, arm = thrust_line(self.aircraft.throttle)
        forward, down = thrust_axes(inclination, np)
        force = force.plus(Vector(thrust * forward, 0.0, thrust * down))
        moment = moment.plus(Vector(0.0, thrust * arm, 0.0))
        velocity = Vector(*velocity_of((V, alpha, beta), np))
        gravity = down_of_euler(phi, theta, np)
        moved = velocity_rate(force.times(1.0 / self.aircraft.mass), gravity, turning, velocity)
        faster, alpha_rate, beta_rate = flow_rates(velocity, moved, np)
        unsteady = self.aircraft.effect_values().get("unsteady_aerodynamics", {})
        reduction = area / (self.aircraft.mass * V * np.cos(beta)) * chord
        alpha_rate = alpha_rate / (1.0 + reduction * unsteady.get("CL_alphadot", 0.0))
        late = area * geometry.cbar * chord * unsteady.get("Cm_alphadot", 0.0) * alpha_rate
        moment = moment.plus(Vector(0.0, late, 0.0))
        spun = angular_acceleration(_known_or_one(self.aircraft.inertia), turning, moment)
        roll_rate, pitch_rate, _ = euler_rates(phi, theta, turning, np)
        return np.array([faster, alpha_rate, spun.y, pitch_rate, beta_rate, spun.x, spun.z, roll_rate])


def _known_or_one(inertia: Inertia) -> Inertia:
    """The inertia with ones in place of moments that are not known; what they make is not to be used."""
    Ixx, Iyy, Izz = (1.0 if math.isnan(value) else value for value in (inertia.Ixx, inertia.Iyy, inertia.Izz))
    return Inertia(Ixx, Iyy, Izz, 0.0 if math.isnan(inertia.Ixz + inertia.Ixx + inertia.Izz) else inertia.Ixz)


def _stall_values(aircraft: Aircraft) -> dict[str, float]:
    stated = aircraft.effect_values().get("stall_separation")
    if stated is None:
        return dict(_STALL)
    return {**_STALL, "depth": 1.0, **{name: value for name, value in stated.items() if name in _STALL}}


def _kirchhoff(attached: Real, depth: float) -> Real:
    """Share of the attached flow's lift: Kirchhoff's theory, Jategaonkar (2015), ch. 12."""
    half = 0.5 * (1.0 + np.sqrt(attached))
    return 1.0 - depth * (1.0 - half * half)
