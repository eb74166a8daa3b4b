"""Scale errors of accelerometers and gyroscopes."""

from __future__ import annotations

from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Values

EFFECT = Effect(
    name="imu_scale",
    station="sensors",
    summary="Accelerometers and gyroscopes read too much or too little by a factor.",
    equation="a' = a (1 + error), w' = w (1 + error), each axis its own",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 10 (instrument errors)",
    parameters=fixed(
        *(SimulationParameter(n, "1", f"scale error of {n}", 0.02, lower=-0.9, upper=2.0) for n in ("ax", "ay", "az")),
        *(SimulationParameter(n, "1", f"scale error of {n}", 0.02, lower=-0.9, upper=2.0) for n in ("p", "q", "r")),
    ),
)


def accelerometers(values: Values, reading: Vector) -> Vector:
    """The specific force (m/s^2) that is read."""
    return Vector(*(reading[i] * (1.0 + values[n]) for i, n in enumerate(("ax", "ay", "az"))))


def gyroscopes(values: Values, reading: Vector) -> Vector:
    """The angular rates (rad/s) that are read."""
    return Vector(*(reading[i] * (1.0 + values[n]) for i, n in enumerate(("p", "q", "r"))))


def true_rates(values: Values, reading: Vector) -> Vector:
    """The true angular rates (rad/s) of the gyroscopes' readings."""
    return Vector(*(reading[i] / (1.0 + values[n]) for i, n in enumerate(("p", "q", "r"))))
