"""An IMU at another place than in the file."""

from __future__ import annotations

from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Values

EFFECT = Effect(
    name="imu_lever_arm",
    station="sensors",
    summary="Accelerometers off their stated place feel rotation otherwise.",
    equation="a' = a + dw/dt x arm + w x (w x arm), arm' = arm + (x, y, z)",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 10 (position of the accelerometers)",
    parameters=fixed(
        *(
            SimulationParameter(n, "m", f"IMU off its stated place along body {n}", 0.1, lower=-50.0, upper=50.0)
            for n in "xyz"
        )
    ),
)


def arm(values: Values) -> Vector:
    """The error of the lever arm, m."""
    return Vector(values["x"], values["y"], values["z"])
