"""The rigid body: six degrees of freedom over a flat, non-rotating earth.

Attitude is a quaternion: it has no singular attitude, its rate is a product of state components (cheap, and smooth for
derivatives), and four numbers instead of three cost nothing. Its norm is kept by the kinematic equation and divided out
where a direction is taken, so that a rounding drift of the norm turns nothing.

Equations: Stevens, Lewis & Johnson (2016), "Aircraft Control and Simulation", ch. 1.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import export

from sysid_node.sim.model.layout import Scalar

#: The body's state: position (m, north-east-down), velocity relative to the steadily moving air (m/s, body axes),
#: attitude quaternion body to earth (scalar first), angular rates (rad/s, body axes).
STATES = ("north", "east", "down", "u", "v", "w", "q0", "q1", "q2", "q3", "p", "q", "r")


class Vector(NamedTuple):
    """Three components along body axes (forward, right, down), or north, east, down."""

    x: Scalar
    y: Scalar
    z: Scalar

    def plus(self, other: Vector) -> Vector:
        """The sum."""
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def minus(self, other: Vector) -> Vector:
        """The difference."""
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def times(self, factor: Scalar | float) -> Vector:
        """Scaled."""
        return Vector(self.x * factor, self.y * factor, self.z * factor)

    def cross(self, other: Vector) -> Vector:
        """The vector product self x other."""
        return Vector(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )


export.register_namedtuple_serialization(Vector, serialized_name="sysid.Vector")


class Body(NamedTuple):
    """The rigid body's state, by part."""

    position: Vector
    velocity: Vector
    attitude: tuple[Scalar, Scalar, Scalar, Scalar]
    rates: Vector


class MassProperties(NamedTuple):
    """Mass (kg), centre of gravity from the file's (m, FRD), inertia about it (kg m^2)."""

    mass: Scalar
    cg: Vector
    Ixx: Scalar
    Iyy: Scalar
    Izz: Scalar
    Ixz: Scalar


def unpack(x: Scalar) -> Body:
    """The state vector (13 or more,) by part."""
    return Body(
        position=Vector(x[0], x[1], x[2]),
        velocity=Vector(x[3], x[4], x[5]),
        attitude=(x[6], x[7], x[8], x[9]),
        rates=Vector(x[10], x[11], x[12]),
    )


def to_earth(attitude: tuple[Scalar, ...], v: Vector) -> Vector:
    """A body-axes vector in north-east-down."""
    a, b, c, d = attitude
    norm = a * a + b * b + c * c + d * d
    return Vector(
        ((a * a + b * b - c * c - d * d) * v.x + 2 * ((b * c - a * d) * v.y + (b * d + a * c) * v.z)) / norm,
        ((a * a - b * b + c * c - d * d) * v.y + 2 * ((b * c + a * d) * v.x + (c * d - a * b) * v.z)) / norm,
        ((a * a - b * b - c * c + d * d) * v.z + 2 * ((b * d - a * c) * v.x + (c * d + a * b) * v.y)) / norm,
    )


def down_in_body(attitude: tuple[Scalar, ...]) -> Vector:
    """The unit vector down, in body axes."""
    a, b, c, d = attitude
    norm = a * a + b * b + c * c + d * d
    return Vector(2 * (b * d - a * c) / norm, 2 * (c * d + a * b) / norm, (a * a - b * b - c * c + d * d) / norm)


def quaternion(phi: Scalar, theta: Scalar, psi: Scalar) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Euler angles (yaw-pitch-roll sequence, rad) to the attitude quaternion."""
    cf, sf = jnp.cos(phi / 2), jnp.sin(phi / 2)
    ct, st = jnp.cos(theta / 2), jnp.sin(theta / 2)
    cp, sp = jnp.cos(psi / 2), jnp.sin(psi / 2)
    return (
        cf * ct * cp + sf * st * sp,
        sf * ct * cp - cf * st * sp,
        cf * st * cp + sf * ct * sp,
        cf * ct * sp - sf * st * cp,
    )


def euler_angles(attitude: tuple[Scalar, ...]) -> Vector:
    """Roll, pitch, heading (rad) of the attitude; heading within +-pi."""
    a, b, c, d = attitude
    down = down_in_body(attitude)
    level = jnp.sqrt(down.y * down.y + down.z * down.z)
    return Vector(
        jnp.arctan2(down.y, down.z),
        jnp.arctan2(-down.x, level),
        jnp.arctan2(2 * (b * c + a * d), a * a + b * b - c * c - d * d),
    )


def angular_momentum(body: MassProperties, rates: Vector) -> Vector:
    """Of a body symmetric about its x-z plane, about the CG, N m s (or, of an acceleration, N m)."""
    return Vector(body.Ixx * rates.x - body.Ixz * rates.z, body.Iyy * rates.y, body.Izz * rates.z - body.Ixz * rates.x)


def angular_acceleration(body: MassProperties, rates: Vector, moment: Vector) -> Vector:
    """Euler's equation, rad/s^2; moment about the CG, N m."""
    rest = moment.minus(rates.cross(angular_momentum(body, rates)))
    determinant = body.Ixx * body.Izz - body.Ixz * body.Ixz
    return Vector(
        (body.Izz * rest.x + body.Ixz * rest.z) / determinant,
        rest.y / body.Iyy,
        (body.Ixz * rest.x + body.Ixx * rest.z) / determinant,
    )


def moment_for(body: MassProperties, rates: Vector, acceleration: Vector) -> Vector:
    """Euler's equation turned round: the moment about the CG (N m) behind an angular acceleration (rad/s^2)."""
    return angular_momentum(body, acceleration).plus(rates.cross(angular_momentum(body, rates)))


def attitude_rate(attitude: tuple[Scalar, ...], rates: Vector) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """The quaternion's rate, 1/2 attitude * (0, rates)."""
    a, b, c, d = attitude
    p, q, r = rates
    return (
        -0.5 * (p * b + q * c + r * d),
        0.5 * (p * a + r * c - q * d),
        0.5 * (q * a - r * b + p * d),
        0.5 * (r * a + q * b - p * c),
    )
