"""A rigid body that moves smoothly and what its instruments read, differentiated by hand: the kinematics are exact.

dv/dt = f + g - omega x v, and the rates of the Euler angles: Klein & Morelli (2006), "Aircraft System Identification",
ch. 3.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_simpson

Array = np.ndarray
G = 9.80665
NAMES = ("ax", "ay", "az", "p", "q", "r", "V", "alpha", "beta", "phi", "theta", "psi")


def readings(seconds: float = 60.0, rate: float = 100.0) -> tuple[Array, dict[str, Array]]:
    """Times (N,) s and readings (N,) by name, in SI units and axes forward, right, down."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    (phi, dphi), (theta, dtheta) = _sines(t, 0.4, 0.9), _sines(t, 0.15, 1.7)
    dpsi = G * np.tan(phi) / 18.0  # turns are coordinated on the whole
    psi = cumulative_simpson(dpsi, x=t, initial=0.0)
    (v, dv), (w, dw), (du0, ddu) = _sines(t, 1.5, 2.3), _sines(t, 1.2, 3.1), _sines(t, 1.0, 0.4)
    u, du = 18.0 + du0, ddu
    p = dphi - dpsi * np.sin(theta)
    q = dtheta * np.cos(phi) + dpsi * np.cos(theta) * np.sin(phi)
    r = -dtheta * np.sin(phi) + dpsi * np.cos(theta) * np.cos(phi)
    force = (
        du + q * w - r * v + G * np.sin(theta),
        dv + r * u - p * w - G * np.sin(phi) * np.cos(theta),
        dw + p * v - q * u - G * np.cos(phi) * np.cos(theta),
    )
    speed = np.sqrt(u * u + v * v + w * w)
    columns = (*force, p, q, r, speed, np.arctan2(w, u), np.arcsin(v / speed), phi, theta, psi)
    return t, dict(zip(NAMES, columns, strict=True))


def _sines(t: Array, size: float, rate: float) -> tuple[Array, Array]:
    """A sum of sines and its slope."""
    parts = [(size / k, rate * k**1.3, 0.7 * k * size * 10) for k in (1, 2, 3)]
    return sum(a * np.sin(w * t + c) for a, w, c in parts), sum(a * w * np.cos(w * t + c) for a, w, c in parts)
