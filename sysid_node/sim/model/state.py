"""The entries of the simulator's state vector."""

from __future__ import annotations

from typing import NamedTuple

from sysid_node.dynamics.attitude import Quaternion
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.model.layout import Scalar

#: The body's state (13,): position (m, north-east-down), velocity relative to the steadily moving air (m/s, body axes),
#: attitude quaternion body to earth (scalar first), angular rates (rad/s, body axes).
STATES = ("north", "east", "down", "u", "v", "w", "q0", "q1", "q2", "q3", "p", "q", "r")

#: Index of the last entry of the continuous state (14,): attached fraction of the flow.
SEPARATION = 13


class BodyState(NamedTuple):
    """The rigid body's state by name."""

    position: Vector
    velocity: Vector
    attitude: Quaternion
    rates: Vector


def body_state(x: Scalar) -> BodyState:
    """The rigid body's state of the first 13 entries of a state vector."""
    return BodyState(
        position=Vector(x[0], x[1], x[2]),
        velocity=Vector(x[3], x[4], x[5]),
        attitude=(x[6], x[7], x[8], x[9]),
        rates=Vector(x[10], x[11], x[12]),
    )
