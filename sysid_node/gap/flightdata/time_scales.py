"""How fast an aircraft is: the band in which it is compared, at which rate, and how long a short flight is.

A transport of 17 t answers its controls five times as slowly as a model aircraft. Above its own modes there is noise
alone, which drowns angular accelerations, for these are slopes. So the band follows the natural frequencies that the
aircraft file gives (Etkin & Reid (1996), Dynamics of Flight, secs. 6.3 and 6.7: the usual approximations).
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, isfinite, pi, sqrt

from sysid_node.aircraft.model import Aircraft
from sysid_node.gap.flightdata.gap_flight import ANALYSIS_RATE
from sysid_node.sim.simulator import LOWEST_RATE

#: Highest frequency that is compared in any aircraft, Hz: above it, vanes contain little information.
HIGHEST_FREQUENCY = 4.0

#: The same as a multiple of the aircraft's fastest mode, whose response to a control has fallen there to a sixteenth.
_OF_FASTEST = 4.0

#: Least and greatest length of a short flight, s. The least is one or two short periods of a small aircraft.
_SHORTEST, _LONGEST = 2.0, 8.0


def highest_frequency(aircraft: Aircraft, *, lateral: bool) -> float:
    """The highest frequency (Hz) that is compared in an aircraft, in the condition for which its derivatives hold.

    It is that of a small aircraft where the file has no ``Cm_alpha``. ``lateral``: whether the lateral motion was
    measured.
    """
    pitching = short_period(aircraft)
    if not pitching:
        return HIGHEST_FREQUENCY
    fastest = max(pitching, dutch_roll(aircraft), roll_subsidence(aircraft)) if lateral else pitching
    return min(HIGHEST_FREQUENCY, _OF_FASTEST * fastest)


def analysis_rate(aircraft: Aircraft, *, lateral: bool) -> float:
    """The rate (whole Hz) at which an aircraft's forces are predicted: in proportion to the highest frequency.

    ``lateral``: whether the lateral motion was measured. A structural mode that the file states vibrates faster.
    """
    if "structural_mode" in aircraft.effects:
        return ANALYSIS_RATE
    share = highest_frequency(aircraft, lateral=lateral) / HIGHEST_FREQUENCY
    return float(max(LOWEST_RATE, ceil(share * ANALYSIS_RATE)))


def short_flight(aircraft: Aircraft) -> float:
    """Length (s) of a short simulated flight: a short period, or two seconds where that is less.

    Short flights show the dynamics before drift hides them.
    """
    frequency = short_period(aircraft)
    return min(max(_SHORTEST, 1.0 / frequency), _LONGEST) if frequency else _SHORTEST


def short_period(aircraft: Aircraft) -> float:
    """Natural frequency (Hz) of the short period, or as fast as it diverges; zero where the file does not say."""
    value, force, speed = _values(aircraft), _force(aircraft), aircraft.reference.airspeed
    chord, inertia = aircraft.geometry.cbar, aircraft.inertia.Iyy
    damping = -force * chord**2 / (2.0 * speed) * value("Cm_q") / inertia
    lift = force * value("CL_alpha") / (aircraft.mass * speed)
    stiffness = -force * chord * value("Cm_alpha") / inertia
    return _frequency(stiffness + damping * lift) if stiffness else 0.0


def dutch_roll(aircraft: Aircraft) -> float:
    """Natural frequency (Hz) of the Dutch roll, or as fast as it diverges; zero where the file does not say."""
    value, force, speed = _values(aircraft), _force(aircraft), aircraft.reference.airspeed
    span, inertia = aircraft.geometry.b, aircraft.inertia.Izz
    damping = force * span**2 / (2.0 * speed) * value("Cn_r") / inertia
    side = force * value("CY_beta") / (aircraft.mass * speed)
    return _frequency(force * span * value("Cn_beta") / inertia + damping * side)


def roll_subsidence(aircraft: Aircraft) -> float:
    """Corner (Hz) of the roll subsidence; zero where the file does not say."""
    span, speed = aircraft.geometry.b, aircraft.reference.airspeed
    rate = _force(aircraft) * span**2 / (2.0 * speed) * _values(aircraft)("Cl_p") / aircraft.inertia.Ixx
    return abs(rate) / (2.0 * pi) if isfinite(rate) else 0.0


def _force(aircraft: Aircraft) -> float:
    """Dynamic pressure times wing area, N."""
    return 0.5 * aircraft.reference.air_density * aircraft.reference.airspeed**2 * aircraft.geometry.S


def _values(aircraft: Aircraft) -> Callable[[str], float]:
    """A derivative's value by its name; zero where the file does not have it."""
    return lambda name: aircraft.derivatives[name].value if name in aircraft.derivatives else 0.0


def _frequency(square: float) -> float:
    """A frequency (Hz) from its square (rad^2/s^2), whatever its sign; zero where it is not known."""
    return sqrt(abs(square)) / (2.0 * pi) if isfinite(square) else 0.0
