"""Values that look unusual: wrong signs, degrees in place of radians, masses and inertias of another aircraft.

A finding is a question to the file's author and no error: a fighter may be unstable on purpose. Signs follow the file's
conventions: elevator trailing edge down, right aileron trailing edge down and rudder trailing edge left are positive.
The sources give the signs and the kind of values; the ranges' ends are a choice, wide about aircraft as in Roskam
(2001), "Airplane Flight Dynamics", app. B, and Beard & McLain (2012), "Small Unmanned Aircraft", app. E.
``aircraft.reading.plausibility`` has wider limits, of what no aircraft has, and warns whenever a file is read.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.dynamics.handbook.modes import Mode
from sysid_node.dynamics.handbook.trim import LevelTrim

ROSKAM = "Roskam (2001), app. B; Beard & McLain (2012), app. E"
KLEIN = "Klein & Morelli (2006), ch. 3"
TENNEKES = "Tennekes (2009), the great flight diagram: W/S = 47 W^(1/3), in N and m"
CHOICE = "a choice of this check"
RAYMER = "Raymer (2018), table 16.1: radii of gyration; wider here"
SCALING = "Froude scaling of Roskam's and Beard & McLain's aircraft; Foster & Bowman (2005), AIAA 2005-1023"
MIL = "MIL-F-8785C, scaled with the span: Foster & Bowman (2005), AIAA 2005-1023"


@dataclass(frozen=True)
class Finding:
    """One quantity against its usual range; ``meaning`` is what it says where it is outside."""

    name: str
    value: float
    low: float
    high: float
    unit: str
    meaning: str
    source: str

    @property
    def unusual(self) -> bool:
        """Whether the value is outside the usual range."""
        return not self.low <= self.value <= self.high

    @property
    def usual(self) -> str:
        """The usual range in words."""
        if math.isinf(self.high):
            return f"above {self.low:.3g}"
        return f"below {self.high:.3g}" if math.isinf(self.low) else f"{self.low:.3g} to {self.high:.3g}"


_DEGREES = "perhaps it is per degree, or"

#: Derivative -> usual range, and what a value outside says. ``{e}``, ``{a}``, ``{r}`` are the controls' symbols.
_DERIVATIVES: tuple[tuple[str, float, float, str, str], ...] = (
    ("CL_alpha", 1.5, 7.5, f"lift hardly or too strongly grows with alpha; {_DEGREES} of another area", ROSKAM),
    ("Cm_alpha", -4.0, 0.0, "positive: unstable in pitch, the CG is behind the neutral point", KLEIN),
    ("Cm_q", -60.0, -0.3, "positive: pitching is driven, not damped; the rate is over q cbar / 2V", ROSKAM),
    ("Cm_{e}", -4.0, -0.1, f"elevator down must lower the nose: negative; {_DEGREES} the elevator is weak", ROSKAM),
    ("CY_beta", -2.0, 0.0, "sideslip from the right must push to the left: negative", KLEIN),
    ("Cl_beta", -0.4, 0.0, "positive: sideslip rolls into the wind, no dihedral effect", KLEIN),
    ("Cl_p", -1.2, -0.1, "positive: rolling is driven, not damped; the rate is over p b / 2V", ROSKAM),
    ("Cl_{a}", -0.6, -0.02, f"right aileron down must roll to the left: negative; {_DEGREES} it is weak", ROSKAM),
    ("Cn_beta", 0.0, 0.5, "negative: no weathercock stability, the nose turns out of the wind", KLEIN),
    ("Cn_r", -0.8, 0.0, "positive: yawing is driven, not damped; the rate is over r b / 2V", KLEIN),
    ("Cn_{r}", -0.3, -0.003, f"rudder to the left must yaw to the left: negative; {_DEGREES} it is weak", ROSKAM),
)

#: Noise (1 sigma) of a sensor -> the largest that is usual, rad or rad/s.
_NOISE = {"alpha": 0.05, "beta": 0.05, "attitude": 0.05, "gyro": 0.15}

#: Mode -> what is compared: frequency (or the inverse of the time constant) times sqrt(span / g), and damping.
_MODES: tuple[tuple[str, float, float, float, float], ...] = (
    ("short period", 0.8, 15.0, 0.15, 2.0),
    ("Dutch roll", 0.5, 8.0, 0.01, 1.0),
    ("roll", 0.5, 60.0, -math.inf, math.inf),
)


def findings(
    aircraft: Aircraft, slopes: Mapping[str, float], trim: LevelTrim, margin: float, modes: Sequence[Mode]
) -> tuple[Finding, ...]:
    """Every check that the file allows, the unusual ones first.

    ``slopes`` are derivatives by name at level flight, ``margin`` is the static margin as a share of the chord.
    """
    found = [*_derivatives(aircraft, slopes), *_flight(aircraft, trim, margin), *_body(aircraft), *_units(aircraft)]
    found += _motions(aircraft, trim, modes)
    return _sorted(found)


def findings_without_flight(aircraft: Aircraft) -> tuple[Finding, ...]:
    """The checks that need no level flight, for a file that has none; derivatives are as the file has them."""
    stated = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    return _sorted([*_derivatives(aircraft, stated), *_body(aircraft), *_units(aircraft)])


def _sorted(found: Iterable[Finding]) -> tuple[Finding, ...]:
    return tuple(sorted((f for f in found if math.isfinite(f.value)), key=lambda finding: not finding.unusual))


def _derivatives(aircraft: Aircraft, slopes: Mapping[str, float]) -> Iterator[Finding]:
    """Only coefficients that the file has; one that it lacks is no mistake of sign."""
    names = {"e": "elevator", "a": "aileron", "r": "rudder"}
    symbols = {key: aircraft.controls[name].symbol for key, name in names.items() if name in aircraft.controls}
    for pattern, low, high, meaning, source in _DERIVATIVES:
        key = pattern[pattern.find("{") + 1] if "{" in pattern else ""
        if key and key not in symbols:
            continue
        name = pattern.format(**symbols)
        if slopes.get(name, 0.0) or name in aircraft.derivatives:
            yield Finding(name, slopes[name], low, high, "1/rad", meaning, source)


def _flight(aircraft: Aircraft, trim: LevelTrim, margin: float) -> Iterator[Finding]:
    yield Finding("static margin", 100.0 * margin, 0.0, 50.0, "%", "unstable, or the nose is very heavy", ROSKAM)
    yield Finding(
        "CD in level flight", trim.drag, 0.008, 0.25, "1", "drag too large for gliding flight, or hardly any", CHOICE
    )
    yield Finding(
        "alpha in level flight",
        math.degrees(trim.alpha),
        -5.0,
        12.0,
        "deg",
        "CL_0, CL_alpha, mass or area may be wrong",
        CHOICE,
    )
    control = aircraft.controls.get("elevator")
    limit = math.degrees(control.limit) if control and control.limit else 20.0
    where = "the file's limit" if control and control.limit else "assumed limit"
    meaning = f"the elevator cannot hold level flight ({where})"
    yield Finding("elevator in level flight", math.degrees(trim.elevator), -limit, limit, "deg", meaning, CHOICE)
    throttle = aircraft.throttle
    if throttle and throttle.max_thrust:
        share = 100.0 * trim.thrust / throttle.max_thrust
        yield Finding(
            "thrust in level flight", share, 2.0, 95.0, "% of max_thrust", "drag or max_thrust may be wrong", CHOICE
        )


def _body(aircraft: Aircraft) -> Iterator[Finding]:
    geometry, inertia, mass = aircraft.geometry, aircraft.inertia, aircraft.mass
    weight = mass * GRAVITY
    usual = 47.0 * weight ** (1.0 / 3.0) / GRAVITY
    meaning = "mass in grams or pounds, or area in another unit"
    yield Finding("mass over wing area", mass / geometry.S, 0.15 * usual, 4.0 * usual, "kg/m^2", meaning, TENNEKES)
    ratio = geometry.b**2 / geometry.S
    yield Finding("aspect ratio b^2/S", ratio, 0.8, 35.0, "1", "span or area in another unit", ROSKAM)
    chord = geometry.cbar * geometry.b / geometry.S
    yield Finding("cbar b / S", chord, 0.95, 1.6, "1", "1 for a rectangle, 1.33 for a triangle", "geometry")
    scale, words = mass * geometry.b**2, "inertia or span in another unit, or of another aircraft"
    for name, low, high in (("Ixx", 0.003, 0.06), ("Iyy", 0.003, 0.15), ("Izz", 0.007, 0.2)):
        yield Finding(f"{name} over m b^2", getattr(inertia, name) / scale, low, high, "1", words, RAYMER)
    flat = inertia.Izz / (inertia.Ixx + inertia.Iyy)
    yield Finding("Izz over Ixx + Iyy", flat, 0.6, 1.0, "1", "above 1 is impossible; a flat body has 1", KLEIN)


def _units(aircraft: Aircraft) -> Iterator[Finding]:
    """Places, noise, joints and servos, which are often in another unit than the file's."""
    size = max(aircraft.geometry.b, aircraft.geometry.cbar)
    for name in ("imu", "air_data"):
        place = math.hypot(*getattr(aircraft.sensors, name))
        yield Finding(
            f"distance of sensors.{name}", place, 0.0, 1.5 * size, "m", "in cm or mm, or not from the CG", CHOICE
        )
    throttle = aircraft.throttle
    if throttle is not None:
        yield Finding("throttle.arm", throttle.arm, -size, size, "m", "in cm or mm, or not from the CG", CHOICE)
    for name, most in _NOISE.items():
        words = "in degrees, or of a poor sensor"
        unit = "rad/s" if name == "gyro" else "rad"
        yield Finding(f"noise.{name}", aircraft.noise[name], 0.0, most, unit, words, CHOICE)
    for control in aircraft.controls.values():
        for joint, scale in control.joints.items():
            name = f"scale of {control.name}'s joint {joint}"
            yield Finding(name, abs(scale), 0.0, 10.0, "rad per unit", "perhaps it is 180 / pi", CHOICE)
    effects = aircraft.effect_values()
    for name, rate in effects.get("actuator_rate_limit", {}).items():
        yield Finding(f"rate limit of {name}", rate, 0.1, 60.0, "rad/s", "in degrees per second", CHOICE)
    for axis, shift in effects.get("cg_shift", {}).items():
        chord = aircraft.geometry.cbar
        yield Finding(f"cg_shift.{axis}", shift, -0.5 * chord, 0.5 * chord, "m", "in cm or mm", CHOICE)


def _motions(aircraft: Aircraft, trim: LevelTrim, modes: Sequence[Mode]) -> Iterator[Finding]:
    """Modes, made comparable across sizes by the time sqrt(span / g)."""
    by_name, time = {mode.name: mode for mode in modes}, math.sqrt(aircraft.geometry.b / GRAVITY)
    for name, low, high, damped_low, damped_high in _MODES:
        if (mode := by_name.get(name)) is not None:
            pace = mode.frequency if mode.eigenvalue.imag else -mode.eigenvalue.real
            words = "too slow or too fast for this size: inertia, stiffness or damping"
            what = f"frequency of the {name}" if mode.eigenvalue.imag else f"inverse time constant of the {name}"
            yield Finding(what, pace, low / time, high / time, "1/s", words, SCALING)
            yield Finding(f"damping of the {name}", mode.damping, damped_low, damped_high, "1", "not damped", SCALING)
    if (mode := by_name.get("phugoid")) is not None:
        slow = math.sqrt(2.0) * GRAVITY / trim.airspeed
        words = "Lanchester's value is sqrt(2) g / V"
        yield Finding("frequency of the phugoid", mode.frequency, 0.4 * slow, 1.6 * slow, "rad/s", words, KLEIN)
    for mode in modes:
        if not mode.stable and mode.name != "phugoid":
            shortest = 12.0 * math.sqrt(aircraft.geometry.b / 11.0)
            words = "grows quickly"
            yield Finding(f"time to double of the {mode.name}", mode.time_to_half, shortest, math.inf, "s", words, MIL)
