"""The International Standard Atmosphere's troposphere (ICAO Doc 7488, 1993)."""

from __future__ import annotations

import jax
import jax.numpy as jnp

#: Standard gravity, m/s^2, and the sea-level density, kg/m^3.
GRAVITY = 9.80665
SEA_LEVEL_DENSITY = 1.225

_LAPSE = 0.0065 / 288.15  # 1/m: temperature gradient over sea-level temperature
_EXPONENT = GRAVITY / (287.05287 * 0.0065) - 1.0


def air_density(altitude: jax.Array | float) -> jax.Array:
    """Air density (kg/m^3) at a geopotential altitude (m), below 11 km."""
    return SEA_LEVEL_DENSITY * jnp.exp(_EXPONENT * jnp.log1p(-_LAPSE * jnp.asarray(altitude)))


def altitude_of(density: float) -> float:
    """The altitude (m) at which the standard air has this density (kg/m^3)."""
    return float((1.0 - (density / SEA_LEVEL_DENSITY) ** (1.0 / _EXPONENT)) / _LAPSE)
