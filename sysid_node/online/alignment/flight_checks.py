"""Checks of a whole flight that comes in pieces: whether its samples are those of this aircraft, in these units."""

from __future__ import annotations

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.live.deflections import DeflectionLimits
from sysid_node.flight.live.mean_force import MeanForce
from sysid_node.flight.live.mean_lift import MeanLift
from sysid_node.flight.live.reading_signs import ReadingSigns
from sysid_node.flight.record import Array
from sysid_node.flight.streams import ImuStream, Stamps
from sysid_node.online.alignment.in_pieces import AlignedSamples
from sysid_node.online.types import AIR, AZ, LIFT, MOTION, controls_in

WAITING = 20_000  # IMU messages that may wait for their neighbours in other topics


class FlightChecks:
    """What the samples so far say of units, signs and axes."""

    def __init__(self, aircraft: Aircraft) -> None:
        self._force, self._lift, self._deflections = MeanForce(), MeanLift(aircraft), DeflectionLimits(aircraft)
        self._signs, self._attitudes = ReadingSigns(), _Attitudes()
        self._controls = controls_in(aircraft)

    def add(self, aligned: AlignedSamples, imu: ImuStream) -> Array:
        """Count the samples that a piece completes, whose last IMU messages are ``imu``.

        Returns roll, pitch and heading (N, 3) at the samples, rad; NaN = not measured.
        """
        time, samples, attitude = aligned.time, aligned.samples, self._attitudes.at(imu, aligned.stamps)
        self._force.add(time, samples[:, AZ])
        self._signs.add(time, samples[:, MOTION], samples[:, AIR], attitude)
        self._lift.add(time, *samples[:, LIFT].T)
        self._deflections.add(time, samples[:, self._controls])
        return attitude

    def check(self, name: str) -> None:
        """Raise InputError, or warn (InputWarning), where something does not go together. Name the flight."""
        self._force.check(name)
        self._signs.opposite_alpha = self._lift.opposite_alpha
        self._signs.check(name, self._force.fault)
        self._lift.check(name)
        self._deflections.check(name)


class _Attitudes:
    """The attitude that IMU messages hold, of which the estimator takes none."""

    def __init__(self) -> None:
        self._stamps, self._angles = np.empty(0, np.int64), np.empty((0, 3))

    def at(self, imu: ImuStream, stamps: Stamps) -> Array:
        """Roll, pitch and heading (N, 3) rad of the messages stamped ``stamps`` (N,), the last of which are ``imu``."""
        known = np.concatenate([self._stamps, imu.arrival.stamp_ns])
        angles = np.concatenate([self._angles, imu.attitude])
        self._stamps, self._angles = known[-WAITING:], angles[-WAITING:]
        if not known.size:
            return np.full((stamps.size, 3), np.nan)
        order = np.argsort(known, kind="stable")
        rows = order[np.minimum(np.searchsorted(known[order], stamps), known.size - 1)]
        return np.where((known[rows] == stamps)[:, np.newaxis], angles[rows], np.nan)
