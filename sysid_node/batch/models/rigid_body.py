"""The rigid aircraft with any of its states; the other states are inputs, as measured.

Flat earth, still air, rigid body, body axes FRD: Klein & Morelli (2006), eqs. 3.33 to 3.37. A state that is not
integrated enters as an input, and so does the specific force of a coefficient that is not modelled. A longitudinal or
lateral model therefore needs no coefficients of the other axes, and a measured airspeed makes thrust unnecessary
(Morelli's SIDPAC does the same). With all eight states it is the six-degree-of-freedom motion of the aircraft.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import jax
import jax.numpy as jnp

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.stated_effects import stated_cg
from sysid_node.batch.models.aerodynamics import coefficient_function, derivative_parameters
from sysid_node.batch.models.gusts import DRIVEN, air_relative, gust_parameters, gust_rates, gust_states
from sysid_node.batch.models.kinematics import at_probe, attitude_rates, flow_rates
from sysid_node.batch.models.model import ModelEquations, Scalars, StateSpaceModel
from sysid_node.dynamics.vector import Vector
from sysid_node.errors import InputError

#: States that may be integrated, each with the coefficient without which it cannot be; None: kinematics alone.
STATES: dict[str, str | None] = {
    "V": "CD",
    "alpha": "CL",
    "beta": "CY",
    "p": "Cl",
    "q": "Cm",
    "r": "Cn",
    "phi": None,
    "theta": None,
}
#: Coefficients that share an equation of motion: with one modelled, so must be the other.
_TOGETHER = {"p": ("Cl", "Cn"), "r": ("Cl", "Cn")}
#: Outputs, with their units.
OUTPUTS = {
    **{
        "V": "m/s",
        "alpha": "rad",
        "beta": "rad",
        "p": "rad/s",
        "q": "rad/s",
        "r": "rad/s",
        "phi": "rad",
        "theta": "rad",
    },
    **{"ax": "m/s^2", "ay": "m/s^2", "az": "m/s^2", "pdot": "rad/s^2", "qdot": "rad/s^2", "rdot": "rad/s^2"},
}
#: Inputs for the forces that are not modelled: the specific force at the CG, m/s^2.
AT_CG = ("ax_cg", "ay_cg", "az_cg")

Signals = Mapping[str, jax.Array]


def rigid_body(
    aircraft: Aircraft,
    states: Sequence[str],
    outputs: Sequence[str],
    *,
    use_prior: bool = False,
    reference_rates: bool = False,
    thrust: bool = True,
    gusts: bool = False,
) -> StateSpaceModel:
    """A model of the aircraft file's derivatives with these states and outputs.

    Inputs are the remaining states, the aircraft's controls, ``rho`` (kg/m^3), ``thrust`` (N; left out, and taken as
    zero, where not ``thrust``) and the specific forces at the CG (m/s^2) that no coefficient models. Outputs ax, ay, az
    are those of the IMU where it sits, V, alpha and beta those of the air-data probe. ``use_prior``: the aircraft
    file's tolerances count. ``gusts`` adds the states of module ``gusts``: V, alpha and beta are then those of the path
    through the mean air. Raises InputError on unknown names and on states whose coefficient has no derivatives.
    """
    modelled = _coefficients_needed(aircraft, states)
    unknown = [name for name in outputs if name not in OUTPUTS]
    if unknown:
        raise InputError(f"outputs {', '.join(unknown)} are not known; known: {', '.join(OUTPUTS)}")
    derivatives = derivative_parameters(aircraft, modelled, use_prior)
    names = tuple(parameter.name for parameter in derivatives)
    all_states = (*states, *(gust_states(states) if gusts else ()))
    inputs = _inputs(aircraft, states, names, modelled, thrust)
    rotation = gust_parameters(all_states)
    bare = replace(aircraft, derivatives={})  # their values are parameters
    named = (names, tuple(p.name for p in rotation))
    equations = _equations(
        _Structure(repr(bare), all_states, inputs, tuple(outputs), named, reference_rates, aircraft=bare)
    )
    return StateSpaceModel(
        name="rigid_body",
        states=all_states,
        inputs=inputs,
        outputs=tuple(outputs),
        parameters=(*derivatives, *rotation),
        derivative=equations.derivative,
        output=equations.output,
        units=dict(OUTPUTS),
        driven={name: DRIVEN[name] for name in all_states if name in DRIVEN} if gusts else None,
    )


def _inputs(
    aircraft: Aircraft, states: Sequence[str], names: Sequence[str], modelled: Sequence[str], thrust: bool
) -> tuple[str, ...]:
    """The model's inputs; ``names`` are those of the derivatives, ``modelled`` the coefficients."""
    given = [name for name in STATES if name not in states]
    tabulated = {name for table in aircraft.tables if table.coefficient in modelled for name in table.over}
    controls = [s for s in aircraft.control_symbols if s in tabulated or any(name.endswith(f"_{s}") for name in names)]
    return (*given, *controls, "rho", *(["thrust"] if thrust else []), *_measured_forces(modelled))


def _coefficients_needed(aircraft: Aircraft, states: Sequence[str]) -> tuple[str, ...]:
    """The coefficients that these states need. Raises InputError where the aircraft file has no derivatives of one."""
    needed: list[str] = []
    for state in states:
        if state not in STATES:
            raise InputError(f"state {state!r} is not known; known: {', '.join(STATES)}")
        for coefficient in _TOGETHER.get(state, (STATES[state],)):
            if coefficient is None or coefficient in needed:
                continue
            if coefficient not in aircraft.model_structure:
                raise InputError(
                    f"aircraft {aircraft.name}: state {state} needs derivatives of {coefficient}, and the file has "
                    f"none; give some or leave {state} out of the states"
                )
            needed.append(coefficient)
    if not needed:
        raise InputError("states phi and theta alone have no aerodynamics; add at least one of V alpha beta p q r")
    if "CD_k" in aircraft.derivatives and "CD" in needed and "CL" not in needed:
        raise InputError("CD_k multiplies CL^2, and alpha is not among the states; add it")
    return tuple(needed)


def _measured_forces(modelled: Sequence[str]) -> list[str]:
    """The specific forces that are inputs; lift and drag share two axes, so that each needs the other."""
    ax_cg, ay_cg, az_cg = AT_CG
    longitudinal = [] if {"CL", "CD"} <= set(modelled) else [ax_cg, az_cg]
    return longitudinal + ([] if "CY" in modelled else [ay_cg])


@dataclass(frozen=True)
class _Structure:
    """What the equations of a model depend on: the aircraft as text, names, and how rates are made non-dimensional."""

    text: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    names: tuple[tuple[str, ...], tuple[str, ...]]
    reference_rates: bool
    aircraft: Aircraft = field(compare=False)


@lru_cache(maxsize=16)
def _equations(structure: _Structure) -> ModelEquations:
    """The equations of a structure, the same ones for all its models, so that they are traced and compiled once."""
    s = structure
    motion = _Motion(s.aircraft, s.states, s.inputs, s.names, s.reference_rates)
    return ModelEquations(motion.derivative, partial(motion.output, s.outputs))


class _Motion:
    """Equations of motion and measurement, as pure functions of state, input and parameters."""

    def __init__(
        self,
        aircraft: Aircraft,
        states: tuple[str, ...],
        inputs: tuple[str, ...],
        names: tuple[tuple[str, ...], tuple[str, ...]],
        reference_rates: bool,
    ) -> None:
        """``names`` of the derivatives, then of the gusts' parameters; theta is in this order."""
        self.aircraft = aircraft
        self.states = states
        self.inputs = inputs
        self.names, self.rotation = names
        self._coefficients = coefficient_function(aircraft, self.names, reference_rates)

    def derivative(self, x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        """Derivatives of the states."""
        s, air, coefficients = self._flow(x, u, theta)
        rates = {**flow_rates(s, self._specific_force(air, coefficients)), **attitude_rates(s)}
        rates |= self._angular(s, air, coefficients) | gust_rates(s, self.aircraft.geometry.b)
        return tuple(rates[name] for name in self.states)

    def output(self, outputs: Sequence[str], x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
        """Measured quantities."""
        s, air, coefficients = self._flow(x, u, theta)
        angular = self._angular(s, air, coefficients)
        values = {**s, **{f"{name}dot": value for name, value in angular.items()}}
        values |= self._at_imu(s, self._specific_force(air, coefficients), angular)
        values |= {name: air[name] for name in ("V", "alpha", "beta")}
        values |= at_probe(self.aircraft.sensors.air_data, air)
        return tuple(values[name] for name in outputs)

    def _flow(
        self, x: Scalars, u: Scalars, theta: Scalars
    ) -> tuple[dict[str, jax.Array], dict[str, jax.Array], dict[str, jax.Array]]:
        """All signals, the same relative to the gusting air, and the coefficients that follow."""
        values = dict(zip(self.states, x, strict=True)) | dict(zip(self.inputs, u, strict=True))
        count = len(self.names)
        s = {"thrust": jnp.zeros_like(u[0])} | values | dict(zip(self.rotation, theta[count:], strict=True))
        air = air_relative(s, self.aircraft.geometry.b)
        return s, air, self._coefficients(air, theta[:count])

    def _specific_force(self, s: Signals, c: Mapping[str, jax.Array]) -> tuple[jax.Array, jax.Array, jax.Array]:
        """At the CG, body axes: modelled where there is a coefficient, else as measured.

        Drag and lift act along the stability axes; either may be the measured one.
        """
        a, throttle = self.aircraft, self.aircraft.throttle
        per_coefficient = 0.5 * s["rho"] * s["V"] ** 2 * a.geometry.S / a.mass
        ca, sa = jnp.cos(s["alpha"]), jnp.sin(s["alpha"])
        line = s["alpha"] + (throttle.inclination if throttle else 0.0)
        push = s["thrust"] / a.mass
        along = -per_coefficient * c["CD"] + push * jnp.cos(line) if "CD" in c else s["ax_cg"] * ca + s["az_cg"] * sa
        down = -per_coefficient * c["CL"] - push * jnp.sin(line) if "CL" in c else s["az_cg"] * ca - s["ax_cg"] * sa
        side = per_coefficient * c["CY"] if "CY" in c else s["ay_cg"]
        return along * ca - down * sa, side, along * sa + down * ca

    def _angular(self, s: Signals, air: Signals, c: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
        """Angular accelerations of the axes whose moments are modelled."""
        a, inertia, about_cg = self.aircraft, self.aircraft.inertia, self._moment_of_shift(air, c)
        pressure = 0.5 * air["rho"] * air["V"] ** 2 * a.geometry.S
        Ixx, Iyy, Izz, Ixz = inertia.Ixx, inertia.Iyy, inertia.Izz, inertia.Ixz
        rates: dict[str, jax.Array] = {}
        if "Cm" in c:
            pitching = pressure * a.geometry.cbar * c["Cm"] + s["thrust"] * (a.throttle.arm if a.throttle else 0.0)
            if not math.isnan(Ixx + Izz):  # not known: a longitudinal flight, in which they are of no account
                pitching += (Izz - Ixx) * s["p"] * s["r"] + Ixz * (s["r"] ** 2 - s["p"] ** 2)
            rates["q"] = (pitching - about_cg.y) / Iyy
        if "Cl" in c and "Cn" in c:
            rolling = pressure * a.geometry.b * c["Cl"] + Ixz * s["p"] * s["q"] + (Iyy - Izz) * s["q"] * s["r"]
            yawing = pressure * a.geometry.b * c["Cn"] - Ixz * s["q"] * s["r"] + (Ixx - Iyy) * s["p"] * s["q"]
            rolling, yawing = rolling - about_cg.x, yawing - about_cg.z
            determinant = Ixx * Izz - Ixz**2
            rates["p"] = (Izz * rolling + Ixz * yawing) / determinant
            rates["r"] = (Ixz * rolling + Ixx * yawing) / determinant
        return rates

    def _moment_of_shift(self, air: Signals, c: Mapping[str, jax.Array]) -> Vector:
        """What the forces add to the moments about the file's point where the CG is stated to be elsewhere, N m."""
        shift = stated_cg(self.aircraft)
        if not any(shift):
            return Vector(0.0, 0.0, 0.0)
        return Vector(*shift).cross(self._specific_force(air, c)).times(self.aircraft.mass)

    def _at_imu(
        self, s: Signals, force: tuple[jax.Array, jax.Array, jax.Array], angular: Mapping[str, jax.Array]
    ) -> dict[str, jax.Array]:
        """Specific force where the IMU sits; unmodelled angular accelerations count as zero."""
        x, y, z = self.aircraft.sensors.imu
        p, q, r = s["p"], s["q"], s["r"]
        zero = jnp.zeros_like(p)
        pd, qd, rd = (angular.get(name, zero) for name in "pqr")
        return {
            "ax": force[0] - (q**2 + r**2) * x + (p * q - rd) * y + (p * r + qd) * z,
            "ay": force[1] + (p * q + rd) * x - (p**2 + r**2) * y + (q * r - pd) * z,
            "az": force[2] + (p * r - qd) * x + (q * r + pd) * y - (p**2 + q**2) * z,
        }
