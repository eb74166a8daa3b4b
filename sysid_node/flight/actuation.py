"""Joints to controls: the aircraft file's linear map, for messages one by one and for arrays of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.checks import ANGLE_LIMIT, joint_fault, throttle_fault, throttle_limit
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class Actuation:
    """How thrust and controls follow from joint positions, in the order in which they are judged and summed."""

    joints: tuple[str, ...]  # that the controls are made of, each once
    controls: tuple[tuple[float, tuple[tuple[int, float], ...]], ...]  # offset, (place in ``joints``, scale)...
    throttle: str | None
    max_thrust: float | None  # None: the throttle joint is in N

    @classmethod
    def of(cls, aircraft: Aircraft) -> Actuation:
        """The map of an aircraft."""
        joints = tuple(dict.fromkeys(joint for control in aircraft.controls.values() for joint in control.joints))
        controls = tuple(
            (control.offset, tuple((joints.index(joint), scale) for joint, scale in control.joints.items()))
            for control in aircraft.controls.values()
        )
        throttle = aircraft.throttle
        return cls(joints, controls, throttle.joint if throttle else None, throttle.max_thrust if throttle else None)

    def places(self, names: Sequence[str]) -> tuple[int, ...]:
        """Where the joints, then the throttle, stand among ``names``; -1 where one is missing."""
        at = {name: i for i, name in reversed(list(enumerate(names)))}
        return tuple(at.get(joint, -1) for joint in (*self.joints, self.throttle or ""))

    def of_message(self, places: Sequence[int], positions: Sequence[float]) -> tuple[float, ...] | str:
        """Thrust (N, NaN = not known) and controls (rad) of one message, or what is wrong with it."""
        count = len(positions)
        *angles, throttle = [positions[i] if 0 <= i < count else math.nan for i in places]
        for name, angle in zip(self.joints, angles, strict=True):
            fault = joint_fault(name, angle)
            if fault is not None:
                return fault
        fault = throttle_fault(throttle, self.max_thrust is None)
        if fault is not None:
            return fault
        values = [throttle if self.max_thrust is None else self.max_thrust * throttle]
        for offset, terms in self.controls:
            total = offset
            for i, scale in terms:
                total = total + scale * angles[i]
            values.append(total)
        return tuple(values)

    def of_array(self, names: Sequence[str], positions: Array) -> tuple[Array, NDArray[np.object_]]:
        """``of_message`` of each row of (N, J): values (N, 1 + controls), faults (N,) (None = good)."""
        absent = np.full(len(positions), np.nan)
        *angles, throttle = [positions[:, i] if i >= 0 else absent for i in self.places(names)]
        with np.errstate(over="ignore", invalid="ignore"):  # in rows that are at fault
            columns = [throttle if self.max_thrust is None else self.max_thrust * throttle]
            for offset, terms in self.controls:
                total = np.full(len(positions), offset)
                for i, scale in terms:
                    total = total + scale * angles[i]
                columns.append(total)
        return np.column_stack(columns), self._faults(angles, throttle)

    def _faults(self, angles: Sequence[Array], throttle: Array) -> NDArray[np.object_]:
        """Reasons by row: the checks of ``of_message``, the last first so that the first one's reason stays."""
        in_newton = self.max_thrust is None
        faults = np.full(throttle.shape, None, object)
        with np.errstate(invalid="ignore"):
            bad = np.flatnonzero(np.abs(throttle) > throttle_limit(in_newton))
            faults[bad] = [throttle_fault(x, in_newton) for x in throttle[bad].tolist()]
            for name, angle in reversed(list(zip(self.joints, angles, strict=True))):
                bad = np.flatnonzero(~(np.abs(angle) <= ANGLE_LIMIT))
                faults[bad] = [joint_fault(name, x) for x in angle[bad].tolist()]
        return faults

    def require(self, names: Sequence[str], said: str) -> None:
        """Raises InputError where ``names`` lack a joint of the controls; ``said`` is the flight's name in it."""
        missing = [joint for joint in self.joints if joint not in names]
        if missing:
            raise InputError(
                f"{said}: actuators have no joint {', '.join(map(repr, missing))}; they have "
                f"{', '.join(map(repr, names)) or 'none'}; name them so under controls in the aircraft file"
            )
