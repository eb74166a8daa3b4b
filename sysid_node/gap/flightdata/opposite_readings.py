"""Whether a surface or the side force is recorded the other way than the aircraft file says.

A diagnosis would explain a surface that is counted the other way by late commands, or not at all, and positions from -1
to 1 by wrong inertias, and it would take its time. So it is told before, by least squares of moments and side force on
flow angle, rates and surfaces (Klein & Morelli (2006), Aircraft System Identification, ch. 5). Gusts and noise make
these estimates smaller; surfaces that are recorded at another time than they act may turn their signs.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.opposite_estimates import opposite_estimates, other_readings, reversed_controls
from sysid_node.batch.regression.filtering import lowpass
from sysid_node.batch.regression.linear_regression import Regression, regress
from sysid_node.batch.regression.measured_coefficients import MeasuredCoefficients, measured_coefficients
from sysid_node.batch.results.estimate import ParameterEstimate
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.record import Array
from sysid_node.gap.flightdata.gap_flight import GapFlight, resampled
from sysid_node.gap.flightdata.time_scales import analysis_rate, highest_frequency

#: Regressors of each equation beside its offset and the surfaces.
_LONGITUDINAL = {"Cm": ("alpha", "q")}
_ALL = {**_LONGITUDINAL, **dict.fromkeys(("Cl", "Cn", "CY"), ("beta", "p", "r"))}

#: By how much (s) surfaces may follow what is recorded of them: so late, steps of half a second look reversed.
_LATE = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)

#: By how much (s) they may act before they are recorded, where their stamps are late: a fast aircraft's motion then
#: looks reversed.
_EARLY = (0.05, 0.075, 0.1, 0.15, 0.2)

_STILL = 1e-6  # rad


class _Equation(NamedTuple):
    """A coefficient and its regressors, ``values`` (N, 1 + p) every ``step`` s; the last regressors are surfaces."""

    names: list[str]
    values: Array
    surfaces: int
    step: float

    def fitted(self, late: float) -> Regression:
        """The equation with surfaces that act ``late`` s after they were recorded, in the time that all share."""
        first, delay = round(_LATE[-1] / self.step), round(late / self.step)
        last = len(self.values) - round(_EARLY[-1] / self.step)
        kept, moved = self.values[first:last], self.values[first - delay : last - delay]
        split = 1 + len(self.names) - self.surfaces
        return regress(self.names, [kept[:, 0]], [np.hstack([kept[:, 1:split], moved[:, split:]])])


def check_directions(aircraft: Aircraft, flight: GapFlight) -> None:
    """Raises InputError where a surface is counted the other way than in the aircraft file.

    Warns (InputWarning) where surfaces seem to be recorded from -1 to 1, or the side force the other way. These are
    less certain: least squares make as little of surfaces that only answer gusts, and an accelerometer that is off its
    place adds to the side force.
    """
    found = measured_coefficients(aircraft, resampled(flight, analysis_rate(aircraft, lateral=flight.lateral)))
    equations = [_equation(aircraft, flight, found, name) for name in (_ALL if flight.lateral else _LONGITUDINAL)]
    undelayed = _estimates(aircraft, equations, _LATE[:1])
    if not opposite_estimates(aircraft, undelayed):
        return
    delayed = _estimates(aircraft, equations, _LATE)
    name = flight.source or "the flight"
    if reversed_controls(aircraft, undelayed) and reversed_controls(aircraft, delayed):
        moved = _estimates(aircraft, equations, (*_LATE, *(-seconds for seconds in _EARLY)))
        agreed = {n: each for n, each in delayed.items() if each.value * moved[n].value > 0.0}
        if wrong := reversed_controls(aircraft, agreed):
            raise InputError(f"{name}: {'; '.join(wrong)}")
    if other_readings(aircraft, undelayed) and (doubtful := other_readings(aircraft, delayed)):
        warnings.warn(f"{name}: {'; '.join(doubtful)}", InputWarning, stacklevel=2)


def _equation(aircraft: Aircraft, flight: GapFlight, found: MeasuredCoefficients, coefficient: str) -> _Equation:
    """The equation of a coefficient in the band that is compared."""
    surfaces = [
        symbol
        for symbol in aircraft.control_symbols
        if f"{coefficient}_{symbol}" in aircraft.derivatives and np.ptp(found.regressors[symbol]) > _STILL
    ]
    names = [name for name in _ALL[coefficient] if name in found.regressors]
    columns = [np.ones(found.time.size), *(found.regressors[name] for name in (*names, *surfaces))]
    frequency = highest_frequency(aircraft, lateral=flight.lateral)
    filtered = lowpass(found.time, np.column_stack([found.coefficients[coefficient], *columns]), frequency)
    step = float(found.time[1] - found.time[0])
    return _Equation([f"{coefficient}_{name}" for name in ("0", *names, *surfaces)], filtered, len(surfaces), step)


def _estimates(
    aircraft: Aircraft, equations: Sequence[_Equation], late: Sequence[float]
) -> dict[str, ParameterEstimate]:
    """The derivatives, each equation with the delay (of ``late``, s) that fits it best."""
    found: dict[str, ParameterEstimate] = {}
    for equation in equations:
        found |= min((equation.fitted(seconds) for seconds in late), key=lambda fit: fit.noise).estimates
    return {name: each for name, each in found.items() if name in aircraft.derivatives}
