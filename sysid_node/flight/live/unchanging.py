"""Whether a reading of the IMU or of the air data stands still in flight: a dead sensor, or a field nobody fills in.

Noise alone changes a reading of a working sensor. Estimates from one that stands still may have narrow intervals that
are wrong: where the lateral specific force is always zero, so would be every derivative of the side force.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.record import FlightRecord

LASTED = 10.0  # s without any change, from which on a reading stands still
EVERY = 0.05  # s between the samples that are compared
BREAK = 1.0  # s between samples, after which all begins anew
_SLOWEST = 0.2  # share of the reference airspeed below which an aircraft stands on the ground

#: The readings as they stand in a sample, in the words of the messages.
READINGS = (
    *("linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"),
    *("angular_velocity.x", "angular_velocity.y", "angular_velocity.z"),
    *("true_airspeed", "angle_of_attack", "sideslip"),
)
_COLUMNS = ("ax", "ay", "az", "p", "q", "r", "V", "alpha", "beta")  # of a record
_LATERAL = {1, 3, 5, 8}  # places of ay, p, r and beta: a flight without noise that is symmetric has none of them
_LONGITUDINAL = {0, 2, 4, 6, 7}  # the others: a simulator without noise keeps them in steady flight
_ANGLES = {7, 8}
#: Coefficients that depend on a reading; all do on one that is not here.
_COEFFICIENTS = {0: {"CL", "CD"}, 1: {"CY"}, 2: {"CL", "CD"}}


@dataclass
class UnchangingReadings:
    """The readings that have not changed for ``LASTED`` s, of samples that come one at a time."""

    values: list[float] = field(default_factory=list)
    since: list[float] = field(default_factory=list)  # s, of the last change of each
    time: float = 0.0  # s, of the last sample that was compared
    next: float = float("-inf")  # s, of the next one

    def add(self, time: float, sample: Sequence[float]) -> None:
        """Compare a sample, whose first values are the ``READINGS``, at a time (s)."""
        if time < self.next:
            return
        now = sample[: len(READINGS)]
        if not self.values or time - self.time > BREAK:
            self.since = [time] * len(READINGS)
        else:
            pairs = zip(now, self.values, self.since, strict=True)
            self.since = [since if value == before else time for value, before, since in pairs]
        self.values, self.time, self.next = list(now), time, time + EVERY

    @property
    def places(self) -> set[int]:
        """The places of the readings that stand still; none of them where the flight is merely symmetric."""
        still = {i for i, since in enumerate(self.since) if self.time - since >= LASTED}
        return still - _LATERAL if still >= _LATERAL and len(still) < len(READINGS) else still

    @property
    def coefficients(self) -> frozenset[str] | None:
        """The coefficients that depend on them; None = all."""
        return coefficients_of(self.places)

    @property
    def fault(self) -> str:
        """What stands still, in words; empty where nothing does."""
        return fault_of(self.places)


def coefficients_of(places: Collection[int]) -> frozenset[str] | None:
    """The coefficients that depend on the readings at these places; None = all."""
    known = [_COEFFICIENTS[place] for place in places if place in _COEFFICIENTS]
    return frozenset[str]().union(*known) if len(known) == len(places) else None


def fault_of(places: Collection[int]) -> str:
    """That the readings at these places stand still, in words; empty where there are none."""
    if not places:
        return ""
    names = ", ".join(READINGS[place] for place in sorted(places))
    remedy = " A flow angle that is not measured must be NaN, or left empty in a table" if _ANGLES & set(places) else ""
    return f"{names}: no change for {LASTED:g} s: a dead sensor, or a field that is not filled in?{remedy}"


def unchanging_places(aircraft: Aircraft, record: FlightRecord) -> set[int]:
    """The places of the readings that stood still at any time of a recorded flight.

    The ground does not count, and neither does steady flight without noise, in which all of an axis stand still.
    """
    _, rows = np.unique(record.time // EVERY, return_index=True)
    missing = np.full(len(record), np.nan)
    samples = np.column_stack([record.columns.get(name, missing) for name in _COLUMNS])[rows]
    flying = ~(samples[:, _COLUMNS.index("V")] < _SLOWEST * aircraft.reference.airspeed)
    readings, places = UnchangingReadings(), set[int]()
    for time, sample in zip(record.time[rows][flying].tolist(), samples[flying].tolist(), strict=True):
        readings.add(time, sample)
        places |= _dead(readings.places)
    return places


def _dead(still: set[int]) -> set[int]:
    """Those of the readings that stand still that steady flight does not explain."""
    explained = [axis for axis in (_LONGITUDINAL, _LATERAL) if still >= axis]
    return still.difference(*explained)


def checked_readings(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record as it is. Warns (InputWarning) where a reading stood still."""
    if fault := fault_of(unchanging_places(aircraft, record)):
        warnings.warn(f"{record.name}: {fault}", InputWarning, stacklevel=2)
    return record


def changing_readings(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record as it is. Raises InputError where a reading stood still."""
    if fault := fault_of(unchanging_places(aircraft, record)):
        raise InputError(f"{record.name}: {fault}")
    return record
