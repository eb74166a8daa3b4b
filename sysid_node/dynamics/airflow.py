"""Airspeed and flow angles of a velocity relative to the air, and their rates.

alpha = atan(w / u), beta = asin(v / V): Klein & Morelli (2006), "Aircraft System Identification", ch. 3.
"""

from __future__ import annotations

from collections.abc import Iterable

from sysid_node.dynamics.vector import Namespace, Real, Triple

#: Airspeed, angle of attack and sideslip; or the rates of these.
Flow = tuple[Real, Real, Real]


def flow_angles(velocity: Triple, xp: Namespace) -> Flow:
    """Airspeed (m/s), alpha and beta (rad) of a velocity relative to the air (m/s, body axes)."""
    u, v, w = velocity
    forward = xp.sqrt(u * u + w * w)
    return xp.sqrt(forward * forward + v * v), xp.arctan2(w, u), xp.arctan2(v, forward)


def speed_of(velocity: Triple, xp: Namespace) -> Real:
    """The magnitude of a velocity, m/s."""
    u, v, w = velocity
    return xp.sqrt(u * u + v * v + w * w)


def velocity_of(flow: Iterable[Real], xp: Namespace) -> Triple:
    """The velocity relative to the air (m/s, body axes) of airspeed (m/s), alpha and beta (rad)."""
    airspeed, alpha, beta = flow
    forward = airspeed * xp.cos(beta)
    return forward * xp.cos(alpha), airspeed * xp.sin(beta), forward * xp.sin(alpha)


def stability_axes(velocity: Triple, xp: Namespace) -> tuple[Real, Real]:
    """Cosine and sine of the angle of attack of a velocity relative to the air, without a call of either."""
    u, _, w = velocity
    forward = xp.sqrt(u * u + w * w)
    return u / forward, w / forward


def flow_rates(velocity: Triple, rate: Triple, xp: Namespace) -> Flow:
    """Rates of airspeed (m/s^2), alpha and beta (rad/s) of a velocity (m/s) and its components' rates (m/s^2).

    Both definitions differentiated.
    """
    u, v, w = velocity
    du, dv, dw = rate
    forward, speed = xp.hypot(u, w), speed_of(velocity, xp)
    faster = (u * du + v * dv + w * dw) / speed
    return faster, (u * dw - w * du) / forward**2, (dv - v * faster / speed) / forward


def wind_axes_rates(flow: Flow, rates: Triple, acceleration: Triple, xp: Namespace) -> Flow:
    """Rates of airspeed (m/s^2), alpha and beta (rad/s), of themselves, the body's rates (rad/s) and its acceleration.

    ``acceleration`` (m/s^2, body axes) is specific force plus gravity. The same as ``flow_rates`` of
    ``rigid_body.velocity_rate``, in states V, alpha, beta: Klein & Morelli (2006), ch. 3; Stevens, Lewis & Johnson
    (2016), sec. 2.5.
    """
    airspeed, alpha, beta = flow
    p, q, r = rates
    gx, gy, gz = acceleration
    ca, sa, cb, sb = xp.cos(alpha), xp.sin(alpha), xp.cos(beta), xp.sin(beta)
    along = gx * ca + gz * sa
    return (
        along * cb + gy * sb,
        (gz * ca - gx * sa) / (airspeed * cb) + q - (p * ca + r * sa) * sb / cb,
        (gy * cb - along * sb) / airspeed + p * sa - r * ca,
    )
