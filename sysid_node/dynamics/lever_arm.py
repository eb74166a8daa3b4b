"""What instruments read that do not sit at the centre of gravity.

Points are vectors from the centre of gravity, m, body axes. Klein & Morelli (2006), "Aircraft System Identification",
ch. 10 (positions of accelerometers and flow vanes).
"""

from __future__ import annotations

from sysid_node.dynamics.vector import Vector


def centripetal(rates: Vector, arm: Vector) -> Vector:
    """Centripetal acceleration w x (w x arm), m/s^2, of a point of a body that turns at constant rates (rad/s)."""
    return rates.cross(rates.cross(arm))


def tangential(angular_acceleration: Vector, arm: Vector) -> Vector:
    """Tangential acceleration dw/dt x arm, m/s^2, of a point of a body; dw/dt in rad/s^2."""
    return angular_acceleration.cross(arm)


def specific_force_at(force: Vector, rates: Vector, angular_acceleration: Vector, arm: Vector) -> Vector:
    """Specific force (m/s^2) at a point, from that at the centre of gravity."""
    return force.plus(tangential(angular_acceleration, arm)).plus(centripetal(rates, arm))


def specific_force_from(force: Vector, rates: Vector, angular_acceleration: Vector, arm: Vector) -> Vector:
    """Specific force (m/s^2) at the centre of gravity, from that at a point."""
    return force.minus(tangential(angular_acceleration, arm)).minus(centripetal(rates, arm))


def velocity_at(velocity: Vector, rates: Vector, arm: Vector) -> Vector:
    """Velocity (m/s) of a point, from that of the centre of gravity."""
    return velocity.plus(rates.cross(arm))


def velocity_from(velocity: Vector, rates: Vector, arm: Vector) -> Vector:
    """Velocity (m/s) of the centre of gravity, from that of a point."""
    return velocity.minus(rates.cross(arm))
