"""Attitude of the body over a flat earth, as a quaternion or as Euler angles, and its rate.

A quaternion (scalar first, body to north-east-down) has no singular attitude, and its rate is a product of state
components. Its norm is kept by the kinematic equation and divided out where a direction is taken, so that a rounding
drift of the norm turns nothing. Euler angles are roll, pitch, heading of the yaw-pitch-roll sequence, rad.

Equations: Stevens, Lewis & Johnson (2016), "Aircraft Control and Simulation", ch. 1; Euler rates also Klein & Morelli
(2006), "Aircraft System Identification", ch. 3.
"""

from __future__ import annotations

from collections.abc import Iterable

from sysid_node.dynamics.vector import Namespace, Real, Vector

#: An attitude quaternion, scalar first.
Quaternion = tuple[Real, Real, Real, Real]


def quaternion(angles: Iterable[Real], xp: Namespace) -> Quaternion:
    """The attitude quaternion of Euler angles (roll, pitch, heading, rad)."""
    roll, pitch, heading = angles
    cf, sf = xp.cos(roll / 2), xp.sin(roll / 2)
    ct, st = xp.cos(pitch / 2), xp.sin(pitch / 2)
    cp, sp = xp.cos(heading / 2), xp.sin(heading / 2)
    return (
        cf * ct * cp + sf * st * sp,
        sf * ct * cp - cf * st * sp,
        cf * st * cp + sf * ct * sp,
        cf * ct * sp - sf * st * cp,
    )


def euler_angles(attitude: Quaternion, xp: Namespace) -> Vector:
    """Roll, pitch, heading (rad) of a quaternion; roll and heading within +-pi."""
    a, b, c, d = attitude
    down = down_in_body(attitude)
    level = xp.sqrt(down.y * down.y + down.z * down.z)
    return Vector(
        xp.arctan2(down.y, down.z),
        xp.arctan2(-down.x, level),
        xp.arctan2(2 * (b * c + a * d), a * a + b * b - c * c - d * d),
    )


def to_earth(attitude: Quaternion, v: Vector) -> Vector:
    """A vector of body axes, in north-east-down."""
    a, b, c, d = attitude
    norm = a * a + b * b + c * c + d * d
    return Vector(
        ((a * a + b * b - c * c - d * d) * v.x + 2 * ((b * c - a * d) * v.y + (b * d + a * c) * v.z)) / norm,
        ((a * a - b * b + c * c - d * d) * v.y + 2 * ((b * c + a * d) * v.x + (c * d - a * b) * v.z)) / norm,
        ((a * a - b * b - c * c + d * d) * v.z + 2 * ((b * d - a * c) * v.x + (c * d + a * b) * v.y)) / norm,
    )


def down_in_body(attitude: Quaternion) -> Vector:
    """The unit vector down in body axes, of a quaternion."""
    a, b, c, d = attitude
    norm = a * a + b * b + c * c + d * d
    return Vector(2 * (b * d - a * c) / norm, 2 * (c * d + a * b) / norm, (a * a - b * b - c * c + d * d) / norm)


def down_of_euler(roll: Real, pitch: Real, xp: Namespace) -> Vector:
    """The unit vector down in body axes, of roll and pitch angle (rad)."""
    cos_pitch = xp.cos(pitch)
    return Vector(-xp.sin(pitch), xp.sin(roll) * cos_pitch, xp.cos(roll) * cos_pitch)


def quaternion_rate(attitude: Quaternion, rates: Vector) -> Quaternion:
    """The quaternion's rate (1/s), 1/2 attitude * (0, rates), of body rates (rad/s)."""
    a, b, c, d = attitude
    p, q, r = rates
    return (
        -0.5 * (p * b + q * c + r * d),
        0.5 * (p * a + r * c - q * d),
        0.5 * (q * a - r * b + p * d),
        0.5 * (r * a + q * b - p * c),
    )


def euler_rates(roll: Real, pitch: Real, rates: Vector, xp: Namespace) -> Vector:
    """Rates of roll, pitch and heading angle (rad/s) of body rates (rad/s); infinite at a pitch angle of 90 deg."""
    p, q, r = rates
    sin_roll, cos_roll = xp.sin(roll), xp.cos(roll)
    heading = (q * sin_roll + r * cos_roll) / xp.cos(pitch)
    return Vector(p + heading * xp.sin(pitch), q * cos_roll - r * sin_roll, heading)
