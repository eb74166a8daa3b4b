"""Whether a flight's deflections are within the limits of its aircraft file: it tells of the actuators' unit.

Autopilots hold surfaces as shares of their travel, from -1 to 1, where the identifier needs rad. The derivatives of
such controls are too small by the limit, and nothing else shows it. No surface stands beyond its limit for long.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputWarning
from sysid_node.flight.record import Array, FlightRecord

BEYOND = 1.25  # times the limit: a surface that is deflected so far is not within it
LASTING = 1.0  # s for which it must be, all together
EVERY = 0.05  # s between the samples that count in flight
_GAP = 0.1  # s: the most that one sample counts for


class DeflectionLimits:
    """How long each control was beyond its limit, and how far, since the beginning."""

    def __init__(self, aircraft: Aircraft) -> None:
        self.aircraft = aircraft
        limits = [control.limit for control in aircraft.controls.values()]
        self._limits = [math.inf if limit is None else limit for limit in limits]
        self._seconds = np.zeros(len(limits))
        self._largest = np.zeros(len(limits))  # rad
        self._time = self._next = -math.inf  # s

    def add(self, time: Array, controls: Array) -> None:
        """Count samples (N,), s, with their controls (N, C), rad, in the aircraft file's order."""
        if not time.size:
            return
        step = np.clip(np.diff(time, prepend=self._time), 0.0, _GAP)
        size = np.nan_to_num(np.abs(controls))
        self._seconds += step @ (size > BEYOND * np.array(self._limits))
        self._largest = np.maximum(self._largest, size.max(axis=0))
        self._time = float(time[-1])

    def add_sample(self, time: float, controls: Sequence[float]) -> None:
        """Count one sample in flight: its time, s, and its controls, rad."""
        if time < self._next:
            return
        self._next = time + EVERY
        if any(abs(angle) > BEYOND * limit for angle, limit in zip(controls, self._limits, strict=True)):
            self.add(np.array([time]), np.array([controls]))
        self._time = time

    @property
    def fault(self) -> str:
        """Which controls are beyond their limits, in words; empty where none is."""
        found = [
            f"{name} is deflected by up to {self._largest[i]:.2f} rad beside a limit of {self._limits[i]:g} rad"
            for i, name in enumerate(self.aircraft.controls)
            if self._seconds[i] >= LASTING
        ]
        if not found:
            return ""
        return (
            f"{', '.join(found)} in the file of {self.aircraft.name!r}: are the positions in rad and not from -1 to 1, "
            "are scale and offset of the joint right, and the limit?"
        )

    def check(self, name: str) -> None:
        """Warn (InputWarning) where a control is beyond its limit."""
        if fault := self.fault:
            warnings.warn(f"{name}: {fault}", InputWarning, stacklevel=2)


def checked_deflections(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record as it is, its deflections checked. Warns as ``DeflectionLimits.check``."""
    missing = np.full(record.time.size, math.nan)
    columns = [record.columns.get(control.symbol, missing) for control in aircraft.controls.values()]
    if columns:
        limits = DeflectionLimits(aircraft)
        limits.add(record.time, np.column_stack(columns))
        limits.check(record.name)
    return record
