"""Whether a reading of the IMU or of the air data stands still in flight: a dead sensor, or a field nobody fills in.

Noise alone changes a reading of a working sensor. Estimates from one that stands still may have narrow intervals that
are wrong: where the lateral specific force is always zero, so would be every derivative of the side force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

LASTED = 10.0  # s without any change, from which on a reading stands still
EVERY = 0.05  # s between the samples that are compared
BREAK = 1.0  # s between samples, after which all begins anew

#: The readings as they stand in a sample, in the words of the messages.
READINGS = (
    *("linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"),
    *("angular_velocity.x", "angular_velocity.y", "angular_velocity.z"),
    *("true_airspeed", "angle_of_attack", "sideslip"),
)
_LATERAL = {1, 3, 5, 8}  # places of ay, p, r and beta: a flight without noise that is symmetric has none of them
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
        concerned = [_COEFFICIENTS.get(place) for place in self.places]
        known = [each for each in concerned if each is not None]
        return frozenset[str]().union(*known) if len(known) == len(concerned) else None

    @property
    def fault(self) -> str:
        """What stands still, in words; empty where nothing does."""
        places = sorted(self.places)
        if not places:
            return ""
        names = ", ".join(READINGS[place] for place in places)
        remedy = "; publish NaN for a flow angle that is not measured" if _ANGLES & set(places) else ""
        return f"{names}: no change for {LASTED:g} s: a dead sensor, or a field that is not filled in?{remedy}"
