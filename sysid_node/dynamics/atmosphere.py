"""Gravity, the troposphere of the International Standard Atmosphere (ICAO Doc 7488, 1993), and dynamic pressure."""

from __future__ import annotations

from sysid_node.dynamics.vector import Namespace, Real

#: Standard gravity, m/s^2.
GRAVITY = 9.80665

#: Density of the standard atmosphere at sea level, kg/m^3.
SEA_LEVEL_DENSITY = 1.225

_LAPSE = 0.0065 / 288.15  # 1/m: temperature gradient over sea-level temperature
_EXPONENT = GRAVITY / (287.05287 * 0.0065) - 1.0


def air_density(altitude: Real, xp: Namespace) -> Real:
    """Air density (kg/m^3) at a geopotential altitude (m), below 11 km."""
    return SEA_LEVEL_DENSITY * xp.exp(_EXPONENT * xp.log1p(-_LAPSE * altitude))


def altitude_of(density: float) -> float:
    """The altitude (m) at which the standard atmosphere has this density (kg/m^3)."""
    return float((1.0 - (density / SEA_LEVEL_DENSITY) ** (1.0 / _EXPONENT)) / _LAPSE)


def speed_of_sound(density: Real, xp: Namespace) -> Real:
    """Speed of sound (m/s) in the standard atmosphere where it has this density (kg/m^3), below 11 km."""
    temperature = 288.15 * xp.exp(xp.log(density / SEA_LEVEL_DENSITY) / _EXPONENT)  # K
    return xp.sqrt(1.4 * 287.05287 * temperature)


def dynamic_pressure(density: Real, airspeed: Real) -> Real:
    """qbar = rho V^2 / 2 (N/m^2) of density (kg/m^3) and true airspeed (m/s)."""
    return 0.5 * density * airspeed * airspeed
