"""The kinematic equations of the flow-angle filter: rates of change, their Jacobian, velocities of other points.

The state is u, v, w (m/s) of the IMU's point against the mean air, phi, theta (rad), and the biases of p and q (rad/s)
and of az (m/s^2).
Source: Klein & Morelli (2006), "Aircraft System Identification", eqs. 3.33 and 3.34, over specific forces.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.online.alignment.flow_angle_model import FlowAngleModel

Array = NDArray[np.float64]


def rates_of_change(x: Sequence[float], imu: Sequence[float]) -> tuple[float, float, float, float, float]:
    """Rates of change of u v w phi theta by the IMU's reading ax ay az (m/s^2) p q r (rad/s)."""
    u, v, w, phi, theta, bias_p, bias_q, bias_az = x
    ax, ay, az, p, q, r = imu[:6]
    p, q, az = p - bias_p, q - bias_q, az - bias_az
    sin_phi, cos_phi, sin_theta, cos_theta = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    return (
        ax - GRAVITY * sin_theta + r * v - q * w,
        ay + GRAVITY * sin_phi * cos_theta + p * w - r * u,
        az + GRAVITY * cos_phi * cos_theta + q * u - p * v,
        p + (q * sin_phi + r * cos_phi) * sin_theta / cos_theta,
        q * cos_phi - r * sin_phi,
    )


def integrated(x: Sequence[float], step: float, before: Sequence[float], now: Sequence[float]) -> list[float]:
    """The state a ``step`` (s) later, by Heun's rule between two IMU readings: no half a sample's delay."""
    first = rates_of_change(x, before)
    ahead = [a + step * d for a, d in zip(x, first, strict=False)] + [*x[5:]]
    second = rates_of_change(ahead, now)
    moved = [a + 0.5 * step * (d + e) for a, d, e in zip(x, first, second, strict=False)]
    return [*moved, *x[5:]]


def jacobian(x: Sequence[float], imu: Sequence[float]) -> Array:
    """(8, 8) of ``rates_of_change`` by the state."""
    u, v, w, phi, theta, bias_p, bias_q, _ = x
    p, q, r = imu[3] - bias_p, imu[4] - bias_q, imu[5]
    sp, cp, st, ct = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    tilt = st / ct
    return np.array(
        [
            [0.0, r, -q, 0.0, -GRAVITY * ct, 0.0, w, 0.0],
            [-r, 0.0, p, GRAVITY * cp * ct, -GRAVITY * sp * st, -w, 0.0, 0.0],
            [q, -p, 0.0, -GRAVITY * sp * ct, -GRAVITY * cp * st, v, -u, -1.0],
            [0.0, 0.0, 0.0, tilt * (q * cp - r * sp), (q * sp + r * cp) / ct**2, -1.0, -tilt * sp, 0.0],
            [0.0, 0.0, 0.0, -q * sp - r * cp, 0.0, 0.0, -cp, 0.0],
            [0.0] * 8,
            [0.0] * 8,
            [0.0] * 8,
        ]
    )


def velocity_at_cg(x: Sequence[float], model: FlowAngleModel, sample: Sequence[float]) -> tuple[float, float, float]:
    """Velocity of the centre of gravity, m/s."""
    a, b, c = model.imu
    return _velocity_at((-a, -b, -c), x, sample)


def angles_at_probe(x: Sequence[float], model: FlowAngleModel, sample: Sequence[float]) -> tuple[float, float]:
    """Alpha and beta (rad) as vanes on the probe would show them."""
    u, v, w = _velocity_at(model.probe, x, sample)
    return math.atan2(w, u), math.atan2(v, math.hypot(u, w))


def _velocity_at(arm: Sequence[float], x: Sequence[float], sample: Sequence[float]) -> tuple[float, float, float]:
    """Velocity (m/s) of the point that lies ``arm`` (m) from the IMU."""
    p, q, r = sample[3] - x[5], sample[4] - x[6], sample[5]
    a, b, c = arm
    return x[0] + q * c - r * b, x[1] + r * a - p * c, x[2] + p * b - q * a
