"""Whether the mean specific force of a flight is that of a flight: it tells of axes, sign and unit of the IMU.

Lift carries an aircraft for most of any flight, so that the mean of the specific force along z, forward-right-down, is
about -g. A single reading may be anything.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np

from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.record import Array, FlightRecord

AVERAGED = 5.0  # s of flight from which on the mean tells
_MOST, _LEAST = -0.3 * GRAVITY, -3.0 * GRAVITY  # m/s^2: the mean of every flight is between
_IN_G = 2.0  # m/s^2: a mean so small is one of readings in g
_NONE = 0.5  # m/s^2: a mean so small tells nothing


@dataclass
class MeanForce:
    """The mean over a flight that comes in pieces."""

    total: float = 0.0  # m/s^2, sum of all
    count: int = 0
    begin: float = math.inf  # s
    end: float = -math.inf  # s

    def add(self, time: Array, az: Array) -> None:
        """Count samples: their times (N,) s and specific forces along z (N,) m/s^2, FRD."""
        if time.size:
            known = az[np.isfinite(az)]
            self.total, self.count = self.total + float(known.sum()), self.count + known.size
            self.begin, self.end = min(self.begin, float(time[0])), max(self.end, float(time[-1]))

    def check(self, name: str) -> None:
        """Raise InputError where its sign or its size is that of no flight; warn (InputWarning) where it is too small.

        A flight shorter than ``AVERAGED`` is not checked.
        """
        fault = self.fault
        if fault and abs(self.total / self.count) < -_MOST:
            warnings.warn(f"{name}: {fault}", InputWarning, stacklevel=2)
        elif fault:
            raise InputError(f"{name}: {fault}")

    @property
    def fault(self) -> str:
        """What is wrong with it, in words; empty where nothing is."""
        if not self.count or self.end - self.begin < AVERAGED:
            return ""
        return fault_of(self.total / self.count)


@dataclass
class RecentMeanForce:
    """The mean over about the last ``AVERAGED`` s, one sample at a time, for use in flight."""

    mean: float = 0.0  # m/s^2
    seconds: float = 0.0  # of flight that count
    _time: float | None = None

    def add(self, time: float, az: float) -> None:
        """Count a sample: its time (s) and its specific force along z (m/s^2, FRD)."""
        step = 0.0 if self._time is None else min(max(time - self._time, 0.0), 0.1 * AVERAGED)
        self._time = time
        if step > 0.0:
            self.seconds = min(self.seconds + step, AVERAGED)
            self.mean += (az - self.mean) * step / self.seconds

    @property
    def fault(self) -> str:
        """What is wrong with it, in words; empty where nothing is, or it is not known yet."""
        return fault_of(self.mean) if self.seconds >= AVERAGED else ""


def fault_of(mean: float) -> str:
    """What is wrong with a mean specific force along z (m/s^2, FRD), and what to look for; empty where nothing is.

    Nothing is said of a mean near zero, as of an IMU that is replaced by zeros.
    """
    size = abs(mean)
    if _LEAST <= mean <= _MOST or size <= _NONE:
        return ""
    if mean >= -_MOST:
        cause = "the axes are not those of body_frame, or z is reversed"
    elif size <= _IN_G:
        cause = "it is in g (multiply by 9.80665), or gravity has been taken out"
    else:
        cause = "its unit is not m/s^2 (in ft/s^2 it is about -32), or the aircraft was out of control"
    return f"mean specific force along z (down) is {mean:.2f} m/s^2, and of a flight about -9.8: {cause}?"


def mean_force(record: FlightRecord) -> MeanForce:
    """The mean over a whole flight."""
    force = MeanForce()
    force.add(record.time, record["az"])
    return force


def checked_force(record: FlightRecord) -> FlightRecord:
    """The record as it is, its mean specific force checked. Raises and warns as ``MeanForce.check``."""
    mean_force(record).check(record.name)
    return record
