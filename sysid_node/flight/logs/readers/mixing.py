"""Commands of the three axes from the commands of surfaces: ailerons, elevons, V-tails and their like are unmixed.

Both PX4 and ArduPilot take a positive command to a surface as trailing edge up (a rudder: to the right), and mix so
that left and right surfaces differ in sign in roll. The signs below therefore hold for both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from sysid_node.flight.record import Array

#: The controls that are unmixed, in the order of roll, pitch and yaw.
AXES = ("aileron", "elevator", "rudder")

#: Signs in roll, pitch and yaw of a positive command to each kind of surface.
SIGNS: Mapping[str, tuple[int, int, int]] = MappingProxyType(
    {
        "aileron": (1, 0, 0),
        "left aileron": (-1, 0, 0),
        "right aileron": (1, 0, 0),
        "elevator": (0, 1, 0),
        "rudder": (0, 0, 1),
        "left elevon": (-1, 1, 0),
        "right elevon": (1, 1, 0),
        "left V-tail": (0, 1, 1),
        "right V-tail": (0, 1, -1),
        "left A-tail": (0, 1, -1),
        "right A-tail": (0, 1, 1),
    }
)


def unmixed(signs: Sequence[tuple[int, int, int]], commands: Array) -> tuple[tuple[str, ...], Array]:
    """The controls that the surfaces move, and their fractions of full command (N, C), from ``commands`` (N, S).

    ``signs`` are those of each surface in roll, pitch and yaw. The axes' commands are the least-squares solution of
    the surfaces' commands being their signed sums. A control is positive with the trailing edge down (aileron: the
    right one; rudder: to the left), which is the opposite of the axis' torque. Axes that no surface moves are left out.
    """
    matrix = np.array(signs, float).reshape(-1, 3)
    moved = [axis for axis in range(3) if matrix[:, axis].any()]
    fractions = -commands @ np.linalg.pinv(matrix[:, moved]).T
    return tuple(AXES[axis] for axis in moved), fractions
