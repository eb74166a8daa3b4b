"""The live aircraft as RViz and Foxglove draw it: a pose, triangles and a line, in ROS's axes (REP-103).

World axes are east-north-up, body axes forward-left-up.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sysid_node.flight.frames import euler_from_quaternion, quaternion_from_euler, turn_vectors
from sysid_node.flight.record import Array
from sysid_node.view.aircraft_mesh import MovingPart, airframe, surfaces
from sysid_node.view.scene import Body, DrawnAircraft

#: Seconds of the way behind the aircraft that are drawn, and the time between two of its points.
TRAIL, _SPACING = 30.0, 0.1


class Pose(NamedTuple):
    """Where a frame is in another: ``position`` (3,) m and ``orientation`` (4,), a quaternion x y z w."""

    position: Array
    orientation: Array


class Triangles(NamedTuple):
    """Corners (T * 3, 3) m in the frame of ``pose``, which stands in the aircraft's body frame."""

    name: str
    corners: Array
    pose: Pose


#: The pose of a frame that is the same as the one it stands in.
SAME = Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


def pose_of(body: Body) -> Pose:
    """The last pose of a body (north-east-down, scalar first) in east-north-up and forward-left-up axes."""
    north, east, down = body.position[-1]
    euler = euler_from_quaternion(np.roll(body.attitude[-1:], -1, axis=1), "frd")
    return Pose(np.array([east, north, -down]), quaternion_from_euler(euler, "flu")[0])


def fixed_parts(shape: DrawnAircraft) -> Triangles:
    """Fuselage, wing, tailplane and fin."""
    return Triangles("airframe", turn_vectors(airframe(shape).corners, "flu"), SAME)


def moving_parts(shape: DrawnAircraft, deflections: Mapping[str, float]) -> list[Triangles]:
    """The controls that the shape has, at these deflections (rad by symbol); zero where none is known."""
    return [_turned(surface, deflections.get(surface.symbol, 0.0)) for surface in surfaces(shape)]


def _turned(surface: MovingPart, deflection: float) -> Triangles:
    half = 0.5 * surface.sign * float(np.nan_to_num(deflection))
    axis = turn_vectors(surface.axis, "flu")
    pose = Pose(turn_vectors(surface.hinge, "flu"), np.append(np.sin(half) * axis, np.cos(half)))
    return Triangles(surface.name, turn_vectors(surface.mesh.corners, "flu"), pose)


class Trail:
    """The way of the last ``TRAIL`` seconds, as points (m, east-north-up)."""

    def __init__(self) -> None:
        self._points: deque[tuple[float, Array]] = deque()

    @property
    def points(self) -> list[Array]:
        """From the oldest to the newest, each (3,)."""
        return [point for _, point in self._points]

    def add(self, body: Body) -> None:
        """Add where the body was; times of a clock that was set back begin a new trail."""
        for time, (north, east, down) in zip(body.time.tolist(), body.position, strict=True):
            if self._points and time < self._points[-1][0]:
                self._points.clear()
            if not self._points or time >= self._points[-1][0] + _SPACING:
                self._points.append((time, np.array([east, north, -down])))
        while self._points and self._points[0][0] < self._points[-1][0] - TRAIL:
            self._points.popleft()
