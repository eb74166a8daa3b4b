"""Whether a flight's mean lift goes with its aircraft file: it tells of the airspeed's and the flow angles' units.

The weight divided by dynamic pressure and wing area is a lift coefficient. The file's derivatives give another one, by
the measured angle of attack.
"""

from __future__ import annotations

import warnings

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputWarning
from sysid_node.flight.live.mean_force import AVERAGED
from sysid_node.flight.record import Array, FlightRecord

_RATIO = 2.5  # of two lift coefficients, or airspeeds, from which they do not go together
_VANE_ERROR = 0.05  # rad: bias of a vane that is not remarkable
_KNOWN = 0.9  # share of the samples in which the angle of attack must be measured
_STALL_ANGLE = 0.15  # rad, mean angle of attack from which a loss of lift may be a stall


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

    def check(self, name: str) -> None:
        """Warn (InputWarning) where the lift is not the aircraft's. Not of a flight shorter than ``AVERAGED``."""
        if self.seconds < AVERAGED or not self._sums["pressure"]:
            return
        lift = self._sums["lift"] / (self._sums["pressure"] * self.aircraft.geometry.S)
        airspeed, expected = self._sums["airspeed"] / self._count, self._expected()
        if expected is None:
            self._check_airspeed(name, airspeed, lift)
        elif not self._go_together(lift, expected):
            text = (
                f"{name}: mean lift coefficient is {lift:.2f} by the weight, the wing area and the mean airspeed of "
                f"{airspeed:.1f} m/s, and {expected:.2f} by the angle of attack and the derivatives of "
                f"{self.aircraft.name!r}: {doubts()}"
            )
            warnings.warn(text, InputWarning, stacklevel=2)

    def _expected(self) -> float | None:
        """The lift coefficient by the file's derivatives; None where it is not known."""
        derivatives = self.aircraft.derivatives
        tabled = any(table.coefficient == "CL" for table in self.aircraft.tables)
        if tabled or "CL_alpha" not in derivatives or self._angles < _KNOWN * self._count:
            return None
        offset = derivatives["CL_0"].value if "CL_0" in derivatives else 0.0
        return offset + derivatives["CL_alpha"].value * self._sums["alpha"] / self._angles

    def _go_together(self, lift: float, expected: float) -> bool:
        slope = abs(self.aircraft.derivatives["CL_alpha"].value)
        stalled = 0.0 < lift < expected and _STALL_ANGLE < self._sums["alpha"] / self._angles < 1.0
        alike = lift * expected > 0.0 and 1.0 / _RATIO < lift / expected < _RATIO
        return alike or stalled or abs(lift - expected) < _VANE_ERROR * slope

    def _check_airspeed(self, name: str, airspeed: float, lift: float) -> None:
        reference = self.aircraft.reference.airspeed
        if not 1.0 / _RATIO < airspeed / reference < _RATIO:
            text = (
                f"{name}: mean airspeed is {airspeed:.1f} m/s, a lift coefficient of {lift:.2f}; the derivatives of "
                f"{self.aircraft.name!r} hold for {reference:g} m/s: {doubts()}"
            )
            warnings.warn(text, InputWarning, stacklevel=2)


def doubts() -> str:
    """What to look for where the lift is not the aircraft's."""
    return "is the airspeed in m/s, the angle of attack in rad, the mass in kg, or is it another aircraft's flight?"


def checked_lift(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record as it is, its mean lift checked. Warns as ``MeanLift.check``."""
    lift = MeanLift(aircraft)
    lift.add(record.time, record["az"], record["V"], record["alpha"], record["rho"])
    lift.check(record.name)
    return record
