"""Whether rates, attitude, air data and accelerations of a flight have the signs and the units that go together.

Axes that are mistaken, a flow angle counted the other way, or an airspeed in knots leave derivatives that are precise
and wrong. They are seen where readings contradict each other that the kinematics relate (``kinematic_relations``).
"""

from __future__ import annotations

import math
import warnings
from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.live.kinematic_relations import RELATIONS, Agreement, KinematicRelations
from sysid_node.flight.record import Array, FlightRecord

_CERTAIN = 6.0  # standard deviations, and the size of the correlation, from which on a sign is certain:
_CLEAR = 0.5  # wind that the aircraft answers correlates readings weakly, and the surer the longer the flight is
_LIKELY = 3.0  # standard deviations from which on a relation tells which of two readings is wrong
#: Times the true airspeed from which on its unit is wrong, and the inverse. In knots it is 1.94 times.
_ANOTHER_UNIT = 1.55
_DEGREES = math.degrees(1.0) / 3.0  # times the true rate from which on it is in degrees
EVERY = 0.05  # s between the samples that count in flight
_JUDGED = 5.0  # s from judgement to judgement in flight
_WAITING = 2000  # IMU messages whose samples may still come

#: By rate: the angle that turns with it, their relation, the one that tells which of the two is wrong, and whether that
#: one holds where it is the rate. An aircraft turns towards the lower wing, by which the bank's sign is told.
_TURNS = {
    "p": ("phi", "roll", "lateral", True),
    "q": ("theta", "pitch", "vertical", False),
    "r": ("psi", "yaw", "lateral", False),
}
_FLOW_ANGLES = {"alpha": ("angle of attack", "below"), "beta": ("sideslip", "the right")}


class Contradictions(NamedTuple):
    """What contradicts the rest, in words; empty where nothing does."""

    fault: str = ""  # readings from which derivatives are estimated
    doubt: str = ""  # angles of the attitude, from which none is


class ReadingSigns:
    """The signs and units of the readings of a flight that comes in pieces."""

    def __init__(self) -> None:
        self._relations = KinematicRelations()

    def add(self, time: Array, motion: Array, air: Array, attitude: Array) -> None:
        """Count samples, as ``KinematicRelations.add``."""
        self._relations.add(time, motion, air, attitude)

    @property
    def contradictions(self) -> Contradictions:
        """What the flight so far shows."""
        return contradictions({name: self._relations.agreement(name) for name in RELATIONS})

    def check(self, name: str) -> None:
        """Raise InputError where readings contradict the rest; warn (InputWarning) where only the attitude does."""
        fault, doubt = self.contradictions
        if fault:
            raise InputError(f"{name}: {fault}")
        if doubt:
            warnings.warn(f"{name}: {doubt}", InputWarning, stacklevel=2)


class ReadingSignsInFlight:
    """The same of samples that come one at a time, some time after the IMU's messages that they are made of."""

    def __init__(self) -> None:
        self.found = Contradictions()
        self._signs = ReadingSigns()
        self._tilts: deque[tuple[int, tuple[float, float]]] = deque(maxlen=_WAITING)
        self._rows: list[tuple[float, ...]] = []
        self._next = self._judged = -math.inf  # s

    def hear(self, stamp_ns: int, tilt: tuple[float, float]) -> None:
        """Keep roll and pitch (rad) of an IMU message until its sample comes."""
        self._tilts.append((stamp_ns, tilt))

    def wants(self, time: float) -> bool:
        """Whether the sample at a time (s) counts: one in ``EVERY`` s does."""
        return time >= self._next

    def add(self, time: float, stamp_ns: int, sample: Sequence[float]) -> bool:
        """Count a sample, whose first values are forces, rates and air data. Whether ``found`` is judged anew."""
        while self._tilts and self._tilts[0][0] < stamp_ns:
            self._tilts.popleft()
        known = bool(self._tilts) and self._tilts[0][0] == stamp_ns
        tilt = self._tilts[0][1] if known else (math.nan, math.nan)
        self._rows.append((time, *sample[:9], *tilt, math.nan))
        self._next = time + EVERY
        if time < self._judged + _JUDGED:
            return False
        self._judged = time
        rows, self._rows = np.array(self._rows), []
        self._signs.add(rows[:, 0], rows[:, 1:7], rows[:, 7:10], rows[:, 10:])
        self.found = self._signs.contradictions
        return True


def contradictions(found: Mapping[str, Agreement]) -> Contradictions:
    """What the agreement of all relations shows. A wrong rate makes other relations wrong, so that it is said alone."""
    in_degrees = [rate for rate, (_, turn, _, _) in _TURNS.items() if _much_less(found[turn])]
    if in_degrees:
        return Contradictions(f"{_listed(in_degrees)}: over {_DEGREES:.0f} times what the attitude turns; in deg/s?")
    rates, angles = _wrong_turns(found)
    if rates:
        axes = "axes are forward, left, up where body_frame is flu, and forward, right, down where it is frd"
        return Contradictions(f"{_listed(rates)}: the sign is wrong by the other readings; {axes}")
    flow = [
        f"{angle}: the sign is wrong by rates and accelerations; it is positive with air from {side}"
        for relation, (angle, side) in _FLOW_ANGLES.items()
        if _opposite(found[relation])
    ]
    doubt = f"{_listed(angles)} of the attitude: the sign is wrong by rates and accelerations" if angles else ""
    return Contradictions(_airspeed_fault(found) or "; ".join(flow), doubt)


def _wrong_turns(found: Mapping[str, Agreement]) -> tuple[list[str], list[str]]:
    """The rates whose sign is wrong, and the angles of the attitude; rates where that cannot be told."""
    turned = [rate for rate, (_, turn, _, _) in _TURNS.items() if _opposite(found[turn])]
    rates, angles = [], []
    for rate in turned:
        angle, _, other, holds = _TURNS[rate]
        score = found[other].score
        told = abs(score) >= _LIKELY and not (other == "lateral" and {"p", "r"} <= set(turned))
        if not told:
            rates.append(f"{rate} or {angle}")
        elif (score > 0.0) == holds:
            rates.append(rate)
        else:
            angles.append(angle)
    if _opposite(found["vertical"]) and not {"q"} & set(turned):
        rates.append("q or az")
    if _opposite(found["lateral"]) and not {"p", "r"} & set(turned):
        rates.append("r or ay")
    return rates, angles


def _airspeed_fault(found: Mapping[str, Agreement]) -> str:
    """That the airspeed is in another unit, in words. Without vanes the relation is too weak to tell."""
    seen = found["vertical"]
    if found["alpha"] == Agreement() or seen.score < _CERTAIN:
        return ""
    if max(seen.inverse, seen.slope) < _ANOTHER_UNIT:
        return ""
    times = math.sqrt(seen.inverse / seen.slope)
    return f"true_airspeed: about {times:.1f} times what accelerations and pitch rate show; is it in m/s?"


def _opposite(seen: Agreement) -> bool:
    return seen.score <= -_CERTAIN and seen.correlation <= -_CLEAR


def _much_less(seen: Agreement) -> bool:
    """Whether an angle turns far less than its rate says."""
    return seen.score >= _CERTAIN and 0.0 < seen.slope < 1.0 / _DEGREES and seen.inverse > _DEGREES


def _listed(names: list[str]) -> str:
    return ", ".join(names)


def checked_signs(record: FlightRecord) -> FlightRecord:
    """The record as it is, its readings' signs checked. Raises and warns as ``ReadingSigns.check``."""
    signs = ReadingSigns()
    missing = np.full(record.time.size, math.nan)
    motion, air, attitude = (
        np.column_stack([record.columns.get(name, missing) for name in names])
        for names in (("ax", "ay", "az", "p", "q", "r"), ("V", "alpha", "beta"), ("phi", "theta", "psi"))
    )
    signs.add(record.time, motion, air, attitude)
    signs.check(record.name)
    return record
