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
from sysid_node.flight.live.mean_force import mean_force
from sysid_node.flight.record import Array, FlightRecord

_CERTAIN = 6.0  # standard deviations from zero from which on the sign of a correlation is certain
#: Size of the correlation that a sign needs as well: that of wind is small, and becomes certain in a long flight.
_CLEAR = 0.5
_MISTIMED = 0.15  # by how much another time must correlate better before an angle of attack counts as late or early
_LIKELY = 3.0  # standard deviations from which on a relation tells which of two readings is wrong
#: Times the true airspeed from which on its unit is wrong, and the inverse. In knots it is 1.94 times.
_ANOTHER_UNIT = 1.55
_CLOSE = 0.9  # correlation of an attitude with its rates from which on it is believed
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
#: By relation: the angle, the side from which air makes it positive, and by how much the correlation of the other sign
#: must be above that of an angle that comes late or early. Both are alike where it oscillates as fast as alpha does.
_FLOW_ANGLES = {"alpha": ("angle of attack", "below", 0.15), "beta": ("sideslip", "the right", 0.05)}
_WRONG = "the sign is wrong by rates and accelerations; it is positive with air from"


class Contradictions(NamedTuple):
    """What contradicts the rest, in words; empty where nothing does."""

    fault: str = ""  # readings from which derivatives are estimated
    doubt: str = ""  # angles of the attitude, from which no derivative is estimated


class ReadingSigns:
    """The signs and units of the readings of a flight that comes in pieces.

    ``opposite_alpha``: whether the mean lift says that the angle of attack has the wrong sign (``mean_lift``).
    """

    def __init__(self) -> None:
        self.opposite_alpha = False
        self._relations = KinematicRelations()

    def add(self, time: Array, motion: Array, air: Array, attitude: Array) -> None:
        """Count samples, as ``KinematicRelations.add``."""
        self._relations.add(time, motion, air, attitude)

    @property
    def contradictions(self) -> Contradictions:
        """What the flight so far shows. A wrong rate makes other relations wrong, so that it is said alone."""
        found = {name: self._relations.agreement(name) for name in RELATIONS}
        rates, angles = _wrong_turns(found)
        fault = _rate_fault(found) or _sign_fault(rates) or self._airspeed_fault(found) or self._flow_fault(found)
        doubt = f"{', '.join(angles)} of the attitude: the sign is wrong by rates and accelerations" if angles else ""
        return Contradictions(fault, "" if fault else doubt)

    def _airspeed_fault(self, found: Mapping[str, Agreement]) -> str:
        """That the airspeed is in another unit, in words.

        Without vanes the relation is too weak to tell, and with an angle of attack that comes late or early it is none.
        """
        seen, known = found["vertical"], found["alpha"] != Agreement()
        if not known or seen.score < _CERTAIN or max(seen.inverse, seen.slope) < _ANOTHER_UNIT:
            return ""
        if self._relations.shifted("alpha") > found["alpha"].correlation + _MISTIMED:
            return ""
        what = "true_airspeed" if found["pitch"].score >= _CERTAIN else "true_airspeed or q"
        times = math.sqrt(seen.inverse / seen.slope)
        return f"{what}: about {times:.2g} times what accelerations and pitch rate show; in m/s and rad/s?"

    def _flow_fault(self, found: Mapping[str, Agreement]) -> str:
        """Which flow angles have the wrong sign, in words. One that comes late or early may seem to."""
        if self.opposite_alpha and found["alpha"].score <= -_LIKELY:
            return f"angle of attack: {_WRONG} below"
        return "; ".join(
            f"{angle}: {_WRONG} {side}"
            for name, (angle, side, clearer) in _FLOW_ANGLES.items()
            if _opposite(found[name])
            and -found[name].correlation > self._relations.shifted(name) + clearer
            and (name == "alpha" or _follows(found["roll"]))  # the side force holds the weight, by the bank
        )

    def check(self, name: str, force_fault: str = "") -> None:
        """Raise InputError where readings contradict the rest; warn (InputWarning) where only the attitude does.

        ``force_fault``: what is wrong with the mean specific force (``mean_force``). Accelerations in g contradict the
        airspeed, too, so that it is said instead.
        """
        fault, doubt = self.contradictions
        if fault:
            raise InputError(f"{name}: {force_fault or fault}")
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

    def add(self, time: float, stamp_ns: int, sample: Sequence[float], *, opposite_alpha: bool = False) -> bool:
        """Count a sample, whose first values are forces, rates and air data. Whether ``found`` is judged anew.

        ``opposite_alpha``: what the mean lift says, as of ``ReadingSigns``.
        """
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
        self._signs.opposite_alpha = opposite_alpha
        self._signs.add(rows[:, 0], rows[:, 1:7], rows[:, 7:10], rows[:, 10:])
        self.found = self._signs.contradictions
        return True


def _wrong_turns(found: Mapping[str, Agreement]) -> tuple[list[str], list[str]]:
    """The rates whose sign is wrong, and the angles of the attitude; rates where that cannot be told.

    Pitch is told without the attitude. Where that is wrong in pitch nothing that depends on it is believed.
    """
    turned = [rate for rate, (_, turn, _, _) in _TURNS.items() if _opposite(found[turn])]
    if "q" in turned and found["vertical"].score >= _LIKELY:
        return [], [_TURNS[rate][0] for rate in turned]
    rates, angles = [], []
    for rate in turned:
        angle, _, other, holds = _TURNS[rate]
        score = found[other].score
        told = abs(score) >= _LIKELY and not (other == "lateral" and {"p", "r"} <= set(turned))
        if not told and not (rate != "q" and _opposite(found["vertical"])):
            rates.append(f"{rate} or {angle}")
        elif not told or (score > 0.0) == holds:
            rates.append(rate)
        else:
            angles.append(angle)
    if _opposite(found["vertical"]) and "q" not in turned:
        rates.append("q or az")
    if _opposite(found["lateral"]) and not {"p", "r"} & set(turned) and _follows(found["roll"]):
        rates.append("r or ay")
    return rates, angles


def _sign_fault(rates: Sequence[str]) -> str:
    """That rates have the wrong sign, in words."""
    axes = "axes are forward, left, up where body_frame is flu, else forward, right, down"
    return f"{', '.join(rates)}: the sign is wrong by the other readings; {axes}" if rates else ""


def _rate_fault(found: Mapping[str, Agreement]) -> str:
    """That rates are in another unit, in words."""
    times = {rate: _times(found[turn]) for rate, (_, turn, _, _) in _TURNS.items()}
    wrong = {rate: f"{factor:.2g}" for rate, factor in times.items() if factor != 1.0}
    if not wrong:
        return ""
    return f"{', '.join(wrong)}: about {', '.join(wrong.values())} times what the attitude turns; in rad/s?"


def _opposite(seen: Agreement) -> bool:
    return seen.score <= -_CERTAIN and seen.correlation <= -_CLEAR


def _follows(seen: Agreement) -> bool:
    return seen.score >= _CERTAIN and seen.correlation >= _CLOSE


def _times(seen: Agreement) -> float:
    """How many times too large a reading is by a relation in which it is the regressor; 1 unless it is far off."""
    if not _follows(seen) or max(seen.inverse, seen.slope) < _ANOTHER_UNIT:
        return 1.0
    return math.sqrt(seen.inverse / seen.slope)


def checked_signs(record: FlightRecord, *, opposite_alpha: bool = False) -> FlightRecord:
    """The record as it is, its readings' signs checked. Raises and warns as ``ReadingSigns.check``.

    ``opposite_alpha``: what the mean lift says, as of ``ReadingSigns``.
    """
    signs = ReadingSigns()
    signs.opposite_alpha = opposite_alpha
    missing = np.full(record.time.size, math.nan)
    motion, air, attitude = (
        np.column_stack([record.columns.get(name, missing) for name in names])
        for names in (("ax", "ay", "az", "p", "q", "r"), ("V", "alpha", "beta"), ("phi", "theta", "psi"))
    )
    signs.add(record.time, motion, air, attitude)
    signs.check(record.name, mean_force(record).fault)
    return record
