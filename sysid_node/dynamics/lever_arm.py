"""What instruments read that do not sit at the centre of gravity.

Points are vectors from the centre of gravity, m, body axes. Klein & Morelli (2006), "Aircraft System Identification",
ch. 10 (positions of accelerometers and flow vanes).
"""

from __future__ import annotations

from sysid_node.dynamics.vector import Triple, Vector


def centripetal(rates: Vector, arm: Triple) -> Vector:
    """Centripetal acceleration w x (w x arm), m/s^2, of a point of a body that turns at constant rates (rad/s)."""
    return rates.cross(rates.cross(arm))


def without_centripetal(force: Triple, rates: Triple, arm: Triple) -> Triple:
    """``force.minus(centripetal(rates, arm))`` written out: quicker for one sample at a time."""
    fx, fy, fz = force
    p, q, r = rates
    x, y, z = arm
    return (
        fx + (q * q + r * r) * x - p * q * y - p * r * z,
        fy - p * q * x + (p * p + r * r) * y - q * r * z,
        fz - p * r * x - q * r * y + (p * p + q * q) * z,
    )


def tangential(angular_acceleration: Vector, arm: Triple) -> Vector:
    """Tangential acceleration dw/dt x arm, m/s^2, of a point of a body; dw/dt in rad/s^2."""
    return angular_acceleration.cross(arm)


def specific_force_at(force: Vector, rates: Vector, angular_acceleration: Vector, arm: Triple) -> Vector:
    """Specific force (m/s^2) at a point, from that at the centre of gravity."""
    return force.plus(tangential(angular_acceleration, arm)).plus(centripetal(rates, arm))


def specific_force_from(force: Vector, rates: Vector, angular_acceleration: Vector, arm: Triple) -> Vector:
    """Specific force (m/s^2) at the centre of gravity, from that at a point."""
    return force.minus(tangential(angular_acceleration, arm)).minus(centripetal(rates, arm))


def velocity_at(velocity: Triple, rates: Triple, arm: Triple) -> Triple:
    """Velocity (m/s) of a point, from that of the centre of gravity."""
    u, v, w = velocity
    p, q, r = rates
    x, y, z = arm
    return u + (q * z - r * y), v + (r * x - p * z), w + (p * y - q * x)


def velocity_from(velocity: Triple, rates: Triple, arm: Triple) -> Triple:
    """Velocity (m/s) of the centre of gravity, from that of a point."""
    u, v, w = velocity
    p, q, r = rates
    x, y, z = arm
    return u - (q * z - r * y), v - (r * x - p * z), w - (p * y - q * x)
