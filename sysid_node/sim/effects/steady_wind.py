"""Wind that is constant in space and time."""

from __future__ import annotations

from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Values

EFFECT = Effect(
    name="steady_wind",
    station="airflow",
    summary="The air moves over the ground. Nothing on board feels it; the path over the ground does.",
    equation="d(position)/dt = R (u, v, w) + wind; the state's velocity is relative to the steadily moving air",
    source="Etkin (1972), Dynamics of Atmospheric Flight (Galilean change of frame)",
    parameters=fixed(
        SimulationParameter("north", "m/s", "air's velocity to the north", 3.0, lower=-60.0, upper=60.0),
        SimulationParameter("east", "m/s", "air's velocity to the east", 3.0, lower=-60.0, upper=60.0),
        SimulationParameter("down", "m/s", "air's velocity downwards", 0.5, lower=-30.0, upper=30.0),
    ),
)


def apply(values: Values, velocity: Vector) -> Vector:
    """Velocity over the ground from velocity through the air, both m/s, north-east-down."""
    return velocity.plus(Vector(values["north"], values["east"], values["down"]))
