"""The chain at one instant: the rates of the state, from the state, the surfaces, the thrust and the gusts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from sysid_node.dynamics.atmosphere import air_density
from sysid_node.dynamics.attitude import down_in_body, quaternion_rate, to_earth
from sysid_node.dynamics.coefficients import Coefficients
from sysid_node.dynamics.rigid_body import MassProperties, accelerations, free_fall
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects import stall_separation, steady_wind, unsteady_aerodynamics
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar, Values
from sysid_node.sim.model.parameters import Parameters, unpack
from sysid_node.sim.model.state import SEPARATION, body_state
from sysid_node.sim.stations import actuator, aerodynamics, airflow, mass, propulsion
from sysid_node.sim.stations.actuator import Servos
from sysid_node.sim.stations.airflow import Air


@partial(
    jax.tree_util.register_dataclass,
    meta_fields=["layout"],
    data_fields=["model", "effects", "body", "servos", "step", "altitude"],
)
@dataclass(frozen=True)
class Chain:
    """An aircraft with its effects: all that is constant during a flight."""

    layout: ParameterLayout
    model: AircraftNumbers
    effects: dict[str, Values]
    body: MassProperties
    servos: Servos
    step: Scalar  # s
    altitude: Scalar  # m, at the start

    @classmethod
    def of(
        cls, layout: ParameterLayout, model: AircraftNumbers, theta: Parameters, step: Scalar, altitude: Scalar
    ) -> Chain:
        """The chain of a parameter vector (P,)."""
        effects = unpack(layout, theta)
        servos = Servos.of(layout, effects, step)
        return cls(layout, model, effects, mass.properties(model, effects), servos, step, altitude)

    def without_servos(self) -> Chain:
        """The chain with actuators that follow at once: for commands that are the actuators' positions already."""
        neutral = {
            name: {key: jnp.zeros_like(value) for key, value in values.items()} if name in actuator.SERVOS else values
            for name, values in self.effects.items()
        }
        return replace(self, effects=neutral, servos=Servos.of(self.layout, neutral, self.step))


class Drive(NamedTuple):
    """What drives the body at one instant."""

    surfaces: Scalar  # (controls,) effective deflections, rad
    thrust: Scalar  # N
    throttle: Scalar  # 0..1, with the motor's lag; tables may be over it
    gusts: Scalar  # (6,) velocity of the air m/s, its rotation rad/s, body axes


class Load(NamedTuple):
    """Aerodynamic and propulsive loads about the file's CG, body axes."""

    coefficients: Coefficients
    force: Vector  # N
    moment: Vector  # N m


class SensedMotion(NamedTuple):
    """The motion that the instruments measure at one instant."""

    air: Air
    coefficients: Coefficients
    specific_force: Vector  # at the CG, m/s^2
    acceleration: Vector  # angular, rad/s^2


@jax.jit
def derivative(chain: Chain, x: Scalar, drive: Drive) -> tuple[Scalar, SensedMotion]:
    """d/dt of the continuous state (14,), and the motion that the instruments measure."""
    effects, state = chain.effects, body_state(x)
    altitude = -state.position.z
    air = airflow.meet(state.velocity, state.rates, drive.gusts, air_density(altitude, jnp))
    falling = free_fall(down_in_body(state.attitude), state.rates, state.velocity)
    load = steady_load(chain, air, drive, x[SEPARATION], altitude - chain.altitude)
    alpha_rate = rate_of_alpha(chain, air, load.force.times(1.0 / chain.body.mass).plus(falling))
    load = unsteady_load(chain, air, load, alpha_rate)
    specific_force, acceleration = accelerations(chain.body, state.rates, load.force, load.moment)
    over_ground = steady_wind.apply(effects["steady_wind"], to_earth(state.attitude, state.velocity))
    rates = (
        *over_ground,
        *specific_force.plus(falling),
        *quaternion_rate(state.attitude, state.rates),
        *acceleration,
        separation_rate(chain, air, x[SEPARATION], alpha_rate),
    )
    return jnp.stack(rates), SensedMotion(air, load.coefficients, specific_force, acceleration)


def steady_load(chain: Chain, air: Air, drive: Drive, separation: Scalar, climb: Scalar) -> Load:
    """Loads of aerodynamics and propulsion without the terms in the rate of alpha; climb (m) since the start."""
    layout, model, effects = chain.layout, chain.model, chain.effects
    surfaces = [drive.surfaces[..., i] for i in range(len(layout.controls))]
    bent = aerodynamics.deflections(layout, model, effects, surfaces, air, drive.thrust)
    regressors = aerodynamics.regressors_of(layout, model, air, bent, drive.throttle)
    coefficients = aerodynamics.coefficients(layout, model, effects, regressors, separation, climb)
    force, moment = aerodynamics.load(model, air, coefficients)
    pull, pull_moment = propulsion.load(model, effects, drive.thrust, air.alpha)
    return Load(coefficients, force.plus(pull), moment.plus(pull_moment))


def unsteady_load(chain: Chain, air: Air, steady: Load, alpha_rate: Scalar) -> Load:
    """The steady loads plus the terms in the rate of alpha (rad/s)."""
    extra = aerodynamics.of_alpha_rate(chain.model, chain.effects, air, alpha_rate)
    force, moment = aerodynamics.load(chain.model, air, extra)
    total = Coefficients(*(a + b for a, b in zip(steady.coefficients, extra, strict=True)))
    return Load(total, steady.force.plus(force), steady.moment.plus(moment))


def rate_of_alpha(chain: Chain, air: Air, velocity_rate: Vector) -> Scalar:
    """dalpha/dt (rad/s) in quasi-steady gusts from dv/dt (m/s^2, body axes), with the lift that dalpha/dt causes."""
    u, _, w = air.velocity
    forward = u * u + w * w
    without = (u * velocity_rate.z - w * velocity_rate.x) / forward
    pressure_area = air.pressure * chain.model.area
    reduction = pressure_area * chain.model.chord / (2.0 * air.speed * chain.body.mass * jnp.sqrt(forward))
    return unsteady_aerodynamics.solve_rate(chain.effects["unsteady_aerodynamics"], without, reduction)


def separation_rate(chain: Chain, air: Air, separation: Scalar, alpha_rate: Scalar) -> Scalar:
    """d/dt of the attached fraction of the flow, 1/s."""
    time_scale = chain.model.chord / air.speed
    values = chain.effects["stall_separation"]
    attached = stall_separation.attached(values, air.alpha, alpha_rate, time_scale)
    return stall_separation.rate(values, separation, attached, time_scale)


def drive_of(chain: Chain, actuators: Scalar, motor: Scalar, gusts: Scalar, time: Scalar) -> tuple[Drive, Scalar]:
    """The drive at a time (s), and the true surfaces (rad) and thrust (N) (controls + 1,).

    ``actuators`` (controls,) are the actuators' positions, rad, and ``motor`` is the motor's thrust, N.
    """
    surfaces = actuator.positions(chain.layout, chain.effects, actuators, time)
    effective = actuator.effective(chain.layout, chain.effects, surfaces, time)
    thrust = propulsion.thrust(chain.effects, motor)
    drive = Drive(jnp.stack(effective, -1), thrust, propulsion.throttle(chain.model, motor), gusts)
    return drive, jnp.stack([*surfaces, thrust], -1)
