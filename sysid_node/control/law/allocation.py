"""Joint positions from controls: the inverse of the aircraft file's map, the smallest of several solutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Allocation:
    """The map from controls and thrust to the positions of the joints (rad; throttle 0..1 or N)."""

    joints: tuple[str, ...]
    offsets: Array  # (M,) rad
    inverse: Array  # (J, M)
    thrust: float | None  # N at a throttle joint of 1; None: there is no throttle

    @classmethod
    def of(cls, aircraft: Aircraft) -> Allocation:
        """The map of an aircraft."""
        controls = list(aircraft.controls.values())
        names = tuple(dict.fromkeys(joint for control in controls for joint in control.joints))
        scales = np.array([[control.joints.get(name, 0.0) for name in names] for control in controls])
        throttle = aircraft.throttle
        return cls(
            joints=(*names, throttle.joint) if throttle else names,
            offsets=np.array([control.offset for control in controls]),
            inverse=np.linalg.pinv(scales),
            thrust=(throttle.max_thrust or 1.0) if throttle else None,
        )

    def positions(self, controls: Sequence[float], thrust: float) -> list[float]:
        """The positions of the joints for controls (M,) rad, in the file's order, and thrust (N)."""
        joints: list[float] = (self.inverse @ (np.asarray(controls) - self.offsets)).tolist()
        return joints if self.thrust is None else [*joints, thrust / self.thrust]
