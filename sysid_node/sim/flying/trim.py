"""Trim: the state and the command of a steady, straight flight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from sysid_node.aircraft.model import AIRSPEEDS
from sysid_node.dynamics.airflow import velocity_of
from sysid_node.dynamics.atmosphere import GRAVITY, altitude_of
from sysid_node.dynamics.attitude import quaternion, to_earth
from sysid_node.errors import InputError
from sysid_node.sim.compiled.programs import kept
from sysid_node.sim.flying.rollout import settled
from sysid_node.sim.model.chain import Chain, derivative, drive_of
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar
from sysid_node.sim.model.state import body_state
from sysid_node.sim.simulator import Simulator
from sysid_node.sim.stations import actuator, propulsion

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Largest residual acceleration of a trim, m/s^2 and rad/s^2.
_TOLERANCE = 1e-8

#: Unknowns of a trim besides the command, rad.
_ANGLES = ("alpha", "beta", "phi", "theta", "gamma")


class TrimPoint(NamedTuple):
    """The flight condition for which a trim is sought."""

    airspeed: Scalar  # m/s
    altitude: Scalar  # m
    heading: Scalar  # rad


@dataclass(frozen=True)
class Trim:
    """A steady, straight flight: the body's state (13,) and the command (controls + 1,) that keeps it."""

    initial: Array
    command: Array
    alpha: float  # rad
    gamma: float  # rad, climb angle through the air


def trim_flight(
    simulator: Simulator,
    airspeed: float | None = None,
    theta: Array | None = None,
    climb_angle: float = 0.0,
    altitude: float | None = None,
    heading: float = 0.0,
) -> Trim:
    """Steady, straight flight without sideslip, wings as level as the aircraft allows.

    ``airspeed`` m/s (default: that of the reference condition), ``theta`` (P,) the effects (default: neutral),
    ``climb_angle`` rad (for an aircraft without an engine it is an unknown of the trim), ``altitude`` m (default: that
    of the reference density), ``heading`` rad. With fewer than three controls the sideslip is free. Raises InputError
    where there is no such trim, naming the unknowns at their limits, and for an aircraft without surfaces.
    """
    if not simulator.aircraft.controls:
        raise InputError(f"aircraft {simulator.aircraft.name!r}: has no surfaces; the simulator needs at least one")
    reference = simulator.aircraft.reference
    speed = reference.airspeed if airspeed is None else airspeed
    least, greatest = AIRSPEEDS
    if not least <= speed <= greatest:
        raise InputError(f"trim: airspeed {speed:g} m/s: expected {least:g} to {greatest:g} m/s")
    height = altitude_of(reference.air_density) if altitude is None else altitude
    point = TrimPoint(jnp.asarray(speed), jnp.asarray(height), jnp.asarray(heading))
    vector = simulator.neutral() if theta is None else theta
    start, lower, upper, free = _search_space(simulator, climb_angle)
    found, left = _solve(simulator, vector, point, start, (lower, upper), free)
    if np.abs(left).max() > _TOLERANCE:
        raise InputError(_why_not(simulator, speed, found, lower, upper))
    state = np.asarray(_state(point, jnp.asarray(found)))
    return Trim(state, found[len(_ANGLES) :], float(found[0]), float(found[4]))


def _solve(
    simulator: Simulator, theta: Array, point: TrimPoint, start: Array, bounds: tuple[Array, Array], free: Index
) -> tuple[Array, Array]:
    """All unknowns (angles, command) at the trim, and the residual (7,) there."""
    fixed = (simulator.layout, simulator.model, theta, point)

    def whole(z: Array) -> Array:
        every = start.copy()
        every[free] = z
        return every

    def residual(z: Array) -> Array:
        return np.asarray(_residual(*fixed, whole(z)))

    def slope(z: Array) -> Array:
        columns = (_slope(*fixed, whole(z), direction) for direction in np.eye(len(start))[free])
        return np.column_stack([np.asarray(column) for column in columns])

    solution = least_squares(
        residual,
        np.clip(start, *bounds)[free],  # a mass that no thrust can carry starts beyond them
        slope,
        bounds=(bounds[0][free], bounds[1][free]),
        x_scale=np.where(free == len(start) - 1, simulator.aircraft.mass, 0.1),
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    return whole(solution.x), solution.fun


def _search_space(simulator: Simulator, climb_angle: float) -> tuple[Array, Array, Array, Index]:
    """Start, lower and upper bounds of all unknowns, and the indices of those that are free."""
    model, powered = simulator.model, simulator.aircraft.throttle is not None
    weight = float(model.mass) * GRAVITY
    thrust = min(0.1 * weight, 0.5 * float(model.max_thrust)) if powered else 0.0
    alpha = float(model.alpha)
    start = np.array([alpha, 0.0, 0.0, alpha + climb_angle, climb_angle, *np.zeros(len(model.limits)), thrust])
    top = [0.7, 0.5, 1.0, 1.5, 1.5, *np.minimum(model.limits, 1.5)]
    upper = np.array([*top, min(float(model.max_thrust), 20.0 * weight)])
    lower = np.array([*(-x for x in top), -1e-9])
    fixed = {1} if len(model.limits) >= 3 else set()
    fixed |= {4} if powered else {len(start) - 1}
    return start, lower, upper, np.array([i for i in range(len(start)) if i not in fixed])


def _imbalance(layout: ParameterLayout, model: AircraftNumbers, theta: Scalar, point: TrimPoint, z: Scalar) -> Scalar:
    """Residual (7,): accelerations (6,) and the error of the sine of the climb angle."""
    chain = Chain.of(layout, model, theta, jnp.asarray(0.01), point.altitude)
    command = z[len(_ANGLES) :]
    zero = jnp.zeros(())
    motor = propulsion.commanded(model, command[-1])
    drive, _ = drive_of(chain, actuator.start(model, command[:-1]).position, motor, jnp.zeros(6), zero)
    state = _state(point, z)
    rates, _ = derivative(chain, settled(chain, state, drive), drive)
    body = body_state(state)
    sink = to_earth(body.attitude, body.velocity).z
    return jnp.concatenate([rates[3:6], rates[10:13], (sink / point.airspeed + jnp.sin(z[4]))[None]])


_residual = kept(1)(_imbalance)


@kept(1)
def _slope(
    layout: ParameterLayout,
    model: AircraftNumbers,
    theta: Scalar,
    point: TrimPoint,
    z: Scalar,
    direction: Scalar | Array,
) -> Scalar:
    """The residual's derivative (7,) along a direction of the unknowns.

    A program for all directions at once takes four times as long to compile, and a trim calls it a few times only.
    """
    slope: Scalar
    _, slope = jax.jvp(lambda y: _imbalance(layout, model, theta, point, y), (z,), (direction,))
    return slope


def _state(point: TrimPoint, z: Scalar) -> Scalar:
    """The body's state (13,) of the unknowns."""
    alpha, beta, phi, theta = z[0], z[1], z[2], z[3]
    zero = jnp.zeros(())
    velocity = velocity_of((point.airspeed, alpha, beta), jnp)
    attitude = quaternion((phi, theta, point.heading), jnp)
    return jnp.stack([zero, zero, -point.altitude, *velocity, *attitude, zero, zero, zero])


def _why_not(simulator: Simulator, speed: float, found: Array, lower: Array, upper: Array) -> str:
    """The message of a missing trim: which unknowns are at their limits, and what to try."""
    names = (*_ANGLES, *simulator.commands)
    margin = 1e-3 * (upper - lower)
    at_limit = [n for n, x, a, b, m in zip(names, found, lower, upper, margin, strict=True) if x < a + m or x > b - m]
    limits = ", ".join(n for n in at_limit if n not in ("beta", "gamma"))
    reason = f"{limits} at its limit" if limits else "the forces do not balance"
    return (
        f"aircraft {simulator.aircraft.name!r}: no steady flight at {speed:g} m/s ({reason}); "
        "try another airspeed or smaller effects"
    )
