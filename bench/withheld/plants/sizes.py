"""Aircraft of other sizes: the shape of one, built smaller or larger for another mass and airspeed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft


@dataclass(frozen=True)
class Size:
    """Mass (kg), airspeed (m/s), air density (kg/m^3), and the instruments' noise as a share of the shape's."""

    mass: float
    airspeed: float
    density: float
    noise: float = 1.0


#: The shape that all have, and the sizes: a model of foam, and a transport.
SHAPE = "kestrel"
SIZES = {"foamie": Size(0.5, 12.0, 1.2), "transport": Size(17000.0, 130.0, 0.9, noise=0.25)}


def sized(name: str) -> Aircraft:
    """The aircraft of a size. It flies level at the lift coefficient of the shape, and has its derivatives."""
    shape, size = _shape(), SIZES[name]
    heavier, longer = size.mass / shape.mass, _longer(shape, size)
    geometry, throttle = shape.geometry, shape.throttle
    assert throttle is not None and throttle.max_thrust is not None
    inertia = {axis: getattr(shape.inertia, axis) * heavier * longer**2 for axis in ("Ixx", "Iyy", "Izz", "Ixz")}
    places = {key: tuple(longer * x for x in getattr(shape.sensors, key)) for key in ("imu", "air_data")}
    return replace(
        shape,
        name=name,
        mass=size.mass,
        inertia=replace(shape.inertia, **inertia),
        geometry=replace(geometry, S=geometry.S * longer**2, b=geometry.b * longer, cbar=geometry.cbar * longer),
        reference=replace(shape.reference, airspeed=size.airspeed, air_density=size.density),
        throttle=replace(throttle, max_thrust=throttle.max_thrust * heavier),
        sensors=replace(shape.sensors, **places),
        noise={sensor: sigma * size.noise for sensor, sigma in shape.noise.items()},
    )


def chord(name: str) -> float:
    """Mean chord of a size, m."""
    shape = _shape()
    return shape.geometry.cbar * _longer(shape, SIZES[name])


def slower(name: str) -> float:
    """How many times as slow as the shape's the motions of a size are: the root of the lengths' ratio (Froude)."""
    return float(np.sqrt(_longer(_shape(), SIZES[name])))


@cache
def _shape() -> Aircraft:
    """The aircraft whose shape all have; its file is read once."""
    return load_aircraft(SHAPE)


def _longer(shape: Aircraft, size: Size) -> float:
    pressure = size.density * size.airspeed**2 / (shape.reference.air_density * shape.reference.airspeed**2)
    return float(np.sqrt(size.mass / shape.mass / pressure))
