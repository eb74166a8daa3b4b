"""The rigid body: six degrees of freedom over a flat, non-rotating earth.

The body is symmetric about its x-z plane: of the products of inertia, only Ixz is not zero. Stevens, Lewis & Johnson
(2016), "Aircraft Control and Simulation", ch. 1; Klein & Morelli (2006), "Aircraft System Identification", eqs. 3.33
to 3.37.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from sysid_node.aircraft.model import Inertia
from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.dynamics.attitude import down_of_euler, euler_rates
from sysid_node.dynamics.vector import Namespace, Real, Triple, Vector


class MomentsOfInertia(Protocol):
    """Moments of inertia about the centre of gravity, kg m^2: an aircraft file's, or ``MassProperties``."""

    @property
    def Ixx(self) -> Real: ...  # noqa: D102

    @property
    def Iyy(self) -> Real: ...  # noqa: D102

    @property
    def Izz(self) -> Real: ...  # noqa: D102

    @property
    def Ixz(self) -> Real: ...  # noqa: D102


class MassProperties(NamedTuple):
    """Mass (kg), centre of gravity from the file's (m, body axes), inertia about it (kg m^2)."""

    mass: Real
    cg: Vector
    Ixx: Real
    Iyy: Real
    Izz: Real
    Ixz: Real


def known_moments(inertia: Inertia) -> Inertia:
    """The inertia with zeros for moments that are not known (NaN), which leaves their products of rates out."""
    moments = (inertia.Ixx, inertia.Iyy, inertia.Izz, inertia.Ixz)
    return Inertia(*(0.0 if math.isnan(moment) else moment for moment in moments))


def angular_momentum(inertia: MomentsOfInertia, rates: Triple) -> Triple:
    """I w about the centre of gravity, N m s, of rates (rad/s); N m of an angular acceleration (rad/s^2)."""
    p, q, r = rates
    return inertia.Ixx * p - inertia.Ixz * r, inertia.Iyy * q, inertia.Izz * r - inertia.Ixz * p


def gyroscopic_moment(inertia: MomentsOfInertia, rates: Triple) -> Triple:
    """w x I w, N m: the moment that it takes to keep the body turning at constant rates (rad/s).

    Written out with the differences of the moments of inertia (Klein & Morelli, eq. 3.37), for one sample at a time;
    ``angular_acceleration`` and ``moment_for`` take the vector product, which JAX compiles as well.
    """
    p, q, r = rates
    return (
        (inertia.Izz - inertia.Iyy) * q * r - inertia.Ixz * p * q,
        (inertia.Ixx - inertia.Izz) * p * r + inertia.Ixz * (p * p - r * r),
        (inertia.Iyy - inertia.Ixx) * p * q + inertia.Ixz * q * r,
    )


def angular_acceleration(inertia: MomentsOfInertia, rates: Vector, moment: Vector) -> Vector:
    """Euler's equation dw/dt = I^-1 (M - w x I w), rad/s^2, of rates (rad/s) and moments about the CG (N m)."""
    rest = moment.minus(rates.cross(angular_momentum(inertia, rates)))
    determinant = inertia.Ixx * inertia.Izz - inertia.Ixz * inertia.Ixz
    return Vector(
        (inertia.Izz * rest.x + inertia.Ixz * rest.z) / determinant,
        rest.y / inertia.Iyy,
        (inertia.Ixz * rest.x + inertia.Ixx * rest.z) / determinant,
    )


def moment_for(inertia: MomentsOfInertia, rates: Vector, acceleration: Triple) -> Vector:
    """Euler's equation solved for the moment about the centre of gravity (N m): M = I dw/dt + w x I w."""
    return Vector(*angular_momentum(inertia, acceleration)).plus(rates.cross(angular_momentum(inertia, rates)))


def free_fall(down: Vector, rates: Vector, velocity: Triple) -> Vector:
    """Rate of the velocity (m/s^2, body axes) of a body on which only gravity acts; ``down`` is the unit vector."""
    return down.times(GRAVITY).minus(rates.cross(velocity))


def velocity_rate(force: Vector, down: Vector, rates: Vector, velocity: Triple) -> Vector:
    """Rate of the velocity's components (m/s^2, body axes) under a specific force (m/s^2): dv/dt = f + g - w x v."""
    return force.plus(free_fall(down, rates, velocity))


def kinematic_rates(
    velocity: Triple, attitude: Vector, force: Vector, rates: Vector, xp: Namespace
) -> tuple[Vector, Vector]:
    """Rates of the velocity's components (m/s^2) and of the Euler angles (rad/s) by specific force and angular rates.

    Klein & Morelli (2006), "Aircraft System Identification", ch. 3 and 10.
    """
    down = down_of_euler(attitude.x, attitude.y, xp)
    return velocity_rate(force, down, rates, velocity), euler_rates(attitude.x, attitude.y, rates, xp)


def accelerations(body: MassProperties, rates: Vector, force: Vector, moment: Vector) -> tuple[Vector, Vector]:
    """Specific force at the centre of gravity (m/s^2) and angular acceleration (rad/s^2).

    ``force`` (N) without gravity, ``moment`` (N m) about the file's centre of gravity.
    """
    about_cg = moment.minus(body.cg.cross(force))
    return force.times(1.0 / body.mass), angular_acceleration(body, rates, about_cg)
