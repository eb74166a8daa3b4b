"""Commands of the three axes from the commands of surfaces: ailerons, elevons, V-tails and their like are unmixed.

Both PX4 and ArduPilot take a positive command to a surface as trailing edge up (a rudder: to the right), and mix so
that left and right surfaces differ in sign in roll. The signs below therefore hold for both. How far a surface moves at
full stick depends on the mixer's gains, which the log's parameters state.
"""

from __future__ import annotations

from collections.abc import Mapping
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


def at_full_stick(gains: Array) -> Array:
    """The commands (S, 3) to the surfaces at full stick in roll, pitch and yaw, from the gains (S, 3) of the mixer.

    A surface moves no further than its full travel, so that a gain above one has the effect of one.
    """
    return np.clip(gains, -1.0, 1.0)


def unmixed(full: Array, commands: Array) -> tuple[tuple[str, ...], Array]:
    """The controls that the surfaces move, and their fractions of full command (N, C), from ``commands`` (N, S).

    ``full`` (S, 3) are the surfaces' commands at full stick in roll, pitch and yaw. The axes' commands are the
    least-squares solution of the surfaces' commands being the sums of their shares, so that full stick is 1. A control
    is positive with the trailing edge down (aileron: the right one; rudder: to the left), which is the opposite of the
    axis' torque. Axes that no surface moves are left out.
    """
    moved = [axis for axis in range(3) if full[:, axis].any()]
    fractions = -commands @ np.linalg.pinv(full[:, moved]).T
    return tuple(AXES[axis] for axis in moved), fractions
