"""An IMU that is not aligned with the body axes."""

from __future__ import annotations

from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Values

EFFECT = Effect(
    name="imu_misalignment",
    station="sensors",
    summary="The IMU is turned against the body by small angles.",
    equation="a' = a - e x a, w' = w - e x w, e the small rotation (roll, pitch, yaw)",
    source="Titterton & Weston (2004), Strapdown Inertial Navigation Technology (small misalignments)",
    parameters=fixed(
        *(
            SimulationParameter(n, "rad", f"rotation about body {axis}", 0.02, lower=-0.5, upper=0.5)
            for n, axis in (("roll", "x"), ("pitch", "y"), ("yaw", "z"))
        ),
    ),
)


def apply(values: Values, reading: Vector) -> Vector:
    """The components of a body-axes vector along the rotated instrument's axes."""
    rotation = Vector(values["roll"], values["pitch"], values["yaw"])
    return reading.minus(rotation.cross(reading))


def undo(values: Values, reading: Vector) -> Vector:
    """The body-axes vector of a reading, by (I - e x)^-1 in closed form."""
    rotation = Vector(values["roll"], values["pitch"], values["yaw"])
    x, y, z = rotation
    along = x * reading.x + y * reading.y + z * reading.z
    size = x * x + y * y + z * z
    return reading.plus(rotation.cross(reading)).plus(rotation.times(along)).times(1.0 / (1.0 + size))
