"""Controls from joint positions, by the aircraft file's linear map, for single messages and for arrays of them."""

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

NAMED = 12  # joints that a message lists


@dataclass(frozen=True)
class Actuation:
    """The map from joint positions to thrust and controls, in the order in which they are checked and summed."""

    joints: tuple[str, ...]  # the joints of all controls, each once
    controls: tuple[
        tuple[float, tuple[tuple[int, float], ...]], ...
    ]  # offset, then (place in ``joints``, scale) of each joint
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
        """The places of the joints, then of the throttle, among ``names``; -1 where one is missing."""
        at = {name: i for i, name in reversed(list(enumerate(names)))}
        return tuple(at.get(joint, -1) for joint in (*self.joints, self.throttle or ""))

    def of_message(self, places: Sequence[int], positions: Sequence[float]) -> tuple[float, ...] | str:
        """Thrust (N, NaN = unknown) and controls (rad) of one message, or the reason why it is rejected."""
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
        """``of_message`` for each row of (N, J): values (N, 1 + controls) and reasons (N,), None = accepted."""
        absent = np.full(len(positions), np.nan)
        *angles, throttle = [positions[:, i] if i >= 0 else absent for i in self.places(names)]
        with np.errstate(over="ignore", invalid="ignore"):  # in rows that are rejected
            columns = [throttle if self.max_thrust is None else self.max_thrust * throttle]
            for offset, terms in self.controls:
                total = np.full(len(positions), offset)
                for i, scale in terms:
                    total = total + scale * angles[i]
                columns.append(total)
        return np.column_stack(columns), self._faults(angles, throttle)

    def _faults(self, angles: Sequence[Array], throttle: Array) -> NDArray[np.object_]:
        """Reasons by row: the checks of ``of_message`` in reverse order, so that the first one's reason remains."""
        in_newton = self.max_thrust is None
        faults = np.full(throttle.shape, None, object)
        with np.errstate(invalid="ignore"):
            bad = np.flatnonzero(np.abs(throttle) > throttle_limit(in_newton))
            faults[bad] = [throttle_fault(x, in_newton) for x in throttle[bad].tolist()]
            for name, angle in reversed(list(zip(self.joints, angles, strict=True))):
                bad = np.flatnonzero(~(np.abs(angle) <= ANGLE_LIMIT))
                faults[bad] = [joint_fault(name, x) for x in angle[bad].tolist()]
        return faults

    def require(self, names: Sequence[str], flight: str) -> None:
        """Raise InputError, which names the ``flight``, where ``names`` lack a joint of the controls."""
        missing = [joint for joint in self.joints if joint not in names]
        if missing:
            raise InputError(
                f"{flight}: actuators have no joint {_few(missing)}; they have {_few(names) or 'none'}; "
                "name them so under controls in the aircraft file"
            )


def joint_names(aircraft: Aircraft) -> tuple[str, ...]:
    """The joints that an aircraft has, with its throttle's, each once."""
    joints = [joint for control in aircraft.controls.values() for joint in control.joints]
    return tuple(dict.fromkeys([*joints, *([aircraft.throttle.joint] if aircraft.throttle else [])]))


def _few(names: Sequence[str]) -> str:
    """The first names, and how many more there are."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(map(repr, names[:NAMED])) + more
