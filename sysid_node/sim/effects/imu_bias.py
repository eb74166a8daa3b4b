"""Offsets of accelerometers and gyroscopes."""

from __future__ import annotations

from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Values

EFFECT = Effect(
    name="imu_bias",
    station="sensors",
    summary="Accelerometers and gyroscopes read off by a constant.",
    equation="a' = a + (ax, ay, az), w' = w + (p, q, r)",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 10 (instrument errors)",
    parameters=fixed(
        *(SimulationParameter(n, "m/s^2", f"offset of {n}", 0.1, lower=-20.0, upper=20.0) for n in ("ax", "ay", "az")),
        *(SimulationParameter(n, "rad/s", f"offset of {n}", 0.01, lower=-2.0, upper=2.0) for n in ("p", "q", "r")),
    ),
)


def accelerometers(values: Values, reading: Vector) -> Vector:
    """The specific force (m/s^2) that is read."""
    return reading.plus(Vector(values["ax"], values["ay"], values["az"]))


def gyroscopes(values: Values, reading: Vector) -> Vector:
    """The angular rates (rad/s) that are read."""
    return reading.plus(Vector(values["p"], values["q"], values["r"]))


def true_rates(values: Values, reading: Vector) -> Vector:
    """The true angular rates (rad/s) of the gyroscopes' readings."""
    return reading.minus(Vector(values["p"], values["q"], values["r"]))
