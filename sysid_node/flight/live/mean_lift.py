"""Whether a flight's mean lift goes with its aircraft file: it tells of the airspeed's and the flow angles' units.

The weight divided by dynamic pressure and wing area is a lift coefficient. The file's derivatives give another one, by
the measured angle of attack.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputWarning
from sysid_node.flight.live.mean_force import AVERAGED
from sysid_node.flight.record import Array, FlightRecord

REMEMBERED = 10.0  # s over which the means in flight are taken
EVERY = 0.05  # s between the samples that count in flight
LARGEST_RATIO = 2.5  # of two lift coefficients, or airspeeds, from which they do not agree
STALL_ANGLE = 0.15  # rad, mean angle of attack from which a loss of lift may be a stall
_VANE_ERROR = 0.05  # rad: bias of a vane that is not remarkable
_MEASURED = 0.9  # share of the samples in which the angle of attack must be measured
_LARGEST_ANGLE = 1.0  # rad, mean angle of attack from which the angle is not in rad


@dataclass(frozen=True)
class LiftLimits:
    """How far the measured mean lift coefficient may be from the one by the aircraft file."""

    ratio: float = LARGEST_RATIO  # of the two, or its inverse, from which they do not agree
    vane_error: float = _VANE_ERROR  # rad, bias of a vane that may account for the difference
    stall_angle: float = STALL_ANGLE  # rad, mean angle of attack from which a loss of lift may be a stall


class MeanLift:
    """The means over a flight that comes in pieces."""

    def __init__(self, aircraft: Aircraft) -> None:
        self.aircraft = aircraft
        self.seconds = 0.0
        self._count = self._angles = 0
        self._sums = dict.fromkeys(("lift", "pressure", "airspeed", "alpha"), 0.0)

    def add(self, time: Array, az: Array, airspeed: Array, alpha: Array, density: Array) -> None:
        """Count samples (N,): time s, specific force along z m/s^2 (FRD), airspeed m/s, alpha rad, density kg/m^3."""
        known = np.isfinite(az) & np.isfinite(airspeed)
        if not known.any():
            return
        angles = known & np.isfinite(alpha)
        rho = np.where(np.isfinite(density), density, self.aircraft.reference.air_density)[known]
        self.seconds += float(time[-1] - time[0])
        self._count, self._angles = self._count + int(known.sum()), self._angles + int(angles.sum())
        self._sums["lift"] -= self.aircraft.mass * float(az[known].sum())
        self._sums["pressure"] += 0.5 * float((rho * airspeed[known] ** 2).sum())
        self._sums["airspeed"] += float(airspeed[known].sum())
        self._sums["alpha"] += float(alpha[angles].sum())

    @property
    def _means(self) -> tuple[float, float, float] | None:
        """Lift coefficient, airspeed (m/s) and angle of attack (rad); None in a flight shorter than ``AVERAGED``."""
        if self.seconds < AVERAGED or not self._sums["pressure"]:
            return None
        lift = self._sums["lift"] / (self._sums["pressure"] * self.aircraft.geometry.S)
        known = self._angles >= _MEASURED * self._count
        return lift, self._sums["airspeed"] / self._count, self._sums["alpha"] / self._angles if known else math.nan

    @property
    def opposite_alpha(self) -> bool:
        """Whether the lift agrees with the aircraft file by an angle of attack of the other sign, and only by it."""
        means = self._means
        return means is not None and _agrees_with_opposite(self.aircraft, means[0], means[2])

    def check(self, name: str) -> None:
        """Warn (InputWarning) where the lift is not the aircraft's. Not of a flight shorter than ``AVERAGED``."""
        if (means := self._means) and (fault := fault_of(self.aircraft, *means)):
            warnings.warn(f"{name}: {fault}", InputWarning, stacklevel=2)


class RecentMeanLift:
    """The means over about the last ``REMEMBERED`` s, one sample at a time, for use in flight."""

    def __init__(self, aircraft: Aircraft) -> None:
        self.aircraft = aircraft
        self.seconds = 0.0  # of flight that count
        self._means = [0.0] * 5  # lift N, dynamic pressure Pa, airspeed m/s, alpha rad, share in which alpha is known
        self._time = self._next = -math.inf  # s

    def add(self, time: float, az: float, airspeed: float, alpha: float, density: float) -> None:
        """Count a sample: time s, specific force along z m/s^2 (FRD), airspeed m/s, alpha rad, density kg/m^3."""
        if time < self._next:
            return
        step, self._time, self._next = min(time - self._time, 10.0 * EVERY), time, time + EVERY
        self.seconds = min(self.seconds + step, REMEMBERED)
        share, known = step / self.seconds, math.isfinite(alpha)
        lift, pressure = -self.aircraft.mass * az, 0.5 * density * airspeed * airspeed
        now = (lift, pressure, airspeed, alpha if known else 0.0, float(known))
        self._means = [mean + share * (value - mean) for mean, value in zip(self._means, now, strict=True)]

    @property
    def _known(self) -> tuple[float, float, float] | None:
        """Lift coefficient, airspeed (m/s) and angle of attack (rad); None where they are not known yet.

        They are not at low airspeed, where wheels may carry the aircraft.
        """
        lift, pressure, airspeed, alpha, known = self._means
        slow = airspeed < self.aircraft.reference.airspeed / math.sqrt(LARGEST_RATIO)
        if self.seconds < REMEMBERED or slow or not pressure:
            return None
        angle = alpha / known if known >= _MEASURED else math.nan
        return lift / (pressure * self.aircraft.geometry.S), airspeed, angle

    @property
    def opposite_alpha(self) -> bool:
        """Whether the lift agrees with the aircraft file by an angle of attack of the other sign, and only by it."""
        known = self._known
        return known is not None and _agrees_with_opposite(self.aircraft, known[0], known[2])

    @property
    def fault(self) -> str:
        """What does not go together, in words; empty where nothing is wrong, or it is not known yet."""
        known = self._known
        return fault_of(self.aircraft, *known) if known else ""


def fault_of(aircraft: Aircraft, lift: float, airspeed: float, alpha: float) -> str:
    """What is wrong with means, in words: lift coefficient, airspeed m/s, alpha rad (NaN = not measured)."""
    expected = _expected(aircraft, alpha)
    if math.isnan(expected):
        return _airspeed_fault(aircraft, airspeed, lift)
    if lift_agrees(lift, expected, alpha, aircraft.derivatives["CL_alpha"].value):
        return ""
    opposite = "is the sign of the angle of attack right? It is positive with air from below"
    return (
        f"mean lift coefficient is {lift:.2f} by the weight, the wing area and the mean airspeed of "
        f"{airspeed:.1f} m/s, and {expected:.2f} by the angle of attack and the derivatives of "
        f"{aircraft.name!r}: {opposite if _agrees_with_opposite(aircraft, lift, alpha) else likely_mistakes()}"
    )


def _agrees_with_opposite(aircraft: Aircraft, lift: float, alpha: float) -> bool:
    """Whether a mean lift coefficient agrees with the file by an angle of attack -alpha (rad), and not by alpha."""
    expected, opposite = _expected(aircraft, alpha), _expected(aircraft, -alpha)
    if math.isnan(expected):
        return False
    slope = aircraft.derivatives["CL_alpha"].value
    return not lift_agrees(lift, expected, alpha, slope) and lift_agrees(lift, opposite, -alpha, slope)


def _expected(aircraft: Aircraft, alpha: float) -> float:
    """The lift coefficient by the file's derivatives; NaN where it is not known."""
    derivatives = aircraft.derivatives
    if any(table.coefficient == "CL" for table in aircraft.tables) or "CL_alpha" not in derivatives:
        return math.nan
    offset = derivatives["CL_0"].value if "CL_0" in derivatives else 0.0
    return offset + derivatives["CL_alpha"].value * alpha


def lift_agrees(lift: float, expected: float, alpha: float, slope: float, limits: LiftLimits | None = None) -> bool:
    """Whether a measured mean lift coefficient agrees with the one that the aircraft file gives.

    ``alpha`` (rad) is the mean angle of attack, NaN where no vane measured it: then neither an error of the vane nor a
    stall can account for a difference. ``slope`` is CL_alpha (per rad).
    """
    limits = limits or LiftLimits()
    alike = lift * expected > 0.0 and 1.0 / limits.ratio < lift / expected < limits.ratio
    if alike or math.isnan(alpha):
        return alike
    stalled = 0.0 < lift < expected and limits.stall_angle < alpha < _LARGEST_ANGLE
    return stalled or abs(lift - expected) < limits.vane_error * abs(slope)


def _airspeed_fault(aircraft: Aircraft, airspeed: float, lift: float) -> str:
    reference = aircraft.reference.airspeed
    if 1.0 / LARGEST_RATIO < airspeed / reference < LARGEST_RATIO:
        return ""
    return (
        f"mean airspeed is {airspeed:.1f} m/s, a lift coefficient of {lift:.2f}; the derivatives of "
        f"{aircraft.name!r} hold for {reference:g} m/s: {likely_mistakes()}"
    )


def likely_mistakes() -> str:
    """The question that ends a message where the mean lift does not agree with the aircraft file."""
    return "is the airspeed in m/s, the angle of attack in rad, the mass in kg, or is it another aircraft's flight?"


def mean_lift(aircraft: Aircraft, record: FlightRecord) -> MeanLift:
    """The means over a whole flight."""
    lift = MeanLift(aircraft)
    lift.add(record.time, record["az"], record["V"], record["alpha"], record["rho"])
    return lift


def checked_lift(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record as it is, its mean lift checked. Warns as ``MeanLift.check``."""
    mean_lift(aircraft, record).check(record.name)
    return record
