"""Excitation while somebody else flies: small deflections on top of the commands, until enough is known.

    state = init(aircraft, settings)
    start(state, time)
    deflections = step(state, time, flight)        # (controls,) rad, at every command
    hear(state, time, precision)                   # whenever estimates come

It stops by itself when the derivatives asked for are known well enough, and begins again when they no longer are, if
told to watch. It stops at once, with all surfaces back in the middle, where a limit is passed or a sensor is silent.
What it did, and for how long, is in ``events``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.excite.spec import draw_manoeuvre, parse_segments

Array = NDArray[np.float64]

GRAVITY = 9.80665
RATE = 200.0  # Hz, at which the manoeuvre is drawn
CALM = 1.5  # s of excitation after which estimates are begun anew, when something has changed
AGAIN = 0.5  # s for which a derivative must be badly known before it is excited again
EVENTS = 1000  # the last so many are kept


@dataclass(frozen=True)
class ExcitationSettings:
    """What is flown, what for, and within which limits. Raises InputError on impossible values."""

    manoeuvre: tuple[str, ...] = ("multisine:elevator,aileron,rudder:amplitude=0.02:length=15:low=0.15:high=1.9",)
    derivatives: tuple[str, ...] = ("Cm_alpha", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr")
    accuracy: float = 0.05  # half an interval over the derivative's size
    longest: float = 60.0  # s, after which it stops whatever is known
    watch: bool = False  # begin again when a derivative is no longer known
    largest_amplitude: float = 0.1  # rad
    largest_roll: float = 0.9  # rad
    largest_pitch: float = 0.5  # rad
    least_airspeed: float = 0.7  # of the reference
    most_airspeed: float = 1.5
    least_load_factor: float = 0.0
    most_load_factor: float = 3.0

    def __post_init__(self) -> None:
        for name, (lower, upper) in RANGES.items():
            value = getattr(self, name)
            if not lower <= value <= upper:
                raise InputError(f"setting {name} = {value!r}: expected {lower:g} to {upper:g}")


#: Allowed values, both ends included.
RANGES: Mapping[str, tuple[float, float]] = {
    "accuracy": (0.001, 10.0),
    "longest": (1.0, 3600.0),
    "largest_amplitude": (0.0, 0.5),
    "largest_roll": (0.05, 1.5),
    "largest_pitch": (0.05, 1.5),
    "least_airspeed": (0.3, 1.0),
    "most_airspeed": (1.0, 3.0),
    "least_load_factor": (-5.0, 1.0),
    "most_load_factor": (1.0, 10.0),
}


class FlightCondition(NamedTuple):
    """What the limits are about; NaN = not measured."""

    roll: float  # rad
    pitch: float  # rad
    airspeed: float  # m/s
    load_factor: float


class ExcitationEvent(NamedTuple):
    """Something that was done at a time (s)."""

    time: float
    text: str


@dataclass
class ExciterState:
    """An exciter's memory."""

    aircraft: Aircraft
    settings: ExcitationSettings
    table: Array  # (N, controls) rad at RATE
    events: list[ExcitationEvent] = field(default_factory=list)
    begun: float = math.nan  # s; NaN = not exciting
    missing: tuple[str, ...] = ()  # derivatives not known well enough
    unknown_since: float = math.nan
    armed: bool = False  # watching
    spoilt: bool = False  # whether estimates rest on data from before a change

    @property
    def active(self) -> bool:
        """Whether surfaces are moved, or about to be."""
        return not math.isnan(self.begun)


def init(aircraft: Aircraft, settings: ExcitationSettings) -> ExciterState:
    """Nothing moves. Raises InputError on a manoeuvre or a derivative that the aircraft does not have."""
    unknown = [name for name in settings.derivatives if name not in aircraft.derivatives]
    if unknown:
        raise InputError(f"derivatives: aircraft {aircraft.name!r} has no {', '.join(unknown)}")
    segments = parse_segments(settings.manoeuvre, aircraft)
    end = max(segment.end for segment in segments)
    drawn = draw_manoeuvre(segments, aircraft, RATE, end)
    table = np.column_stack([drawn.deflections[name] for name in aircraft.controls])
    if np.abs(table).max() > settings.largest_amplitude:
        raise InputError(
            f"manoeuvre {drawn.spec!r}: moves {np.abs(table).max():.3g} rad, more than the largest amplitude "
            f"{settings.largest_amplitude:g}; lower it"
        )
    return ExciterState(aircraft, settings, table, missing=settings.derivatives)


def start(state: ExciterState, time: float) -> None:
    """Begin at a time (s). Raises InputError where it is under way already."""
    if state.active:
        raise InputError("excitation is under way; stop it first")
    state.begun, state.armed = time, state.settings.watch
    _log(state, time, "begun")


def stop(state: ExciterState, time: float, why: str) -> None:
    """End at a time (s), and do not begin again by itself."""
    if state.active:
        _end(state, time, why)
    state.armed = False


def receive_estimates(state: ExciterState, time: float, precision: Mapping[str, float]) -> bool:
    """Estimates at a time (s): half of each interval over its derivative's size, infinite where it is not valid.

    Returns whether they should be begun anew, once each time that excitation begins again by itself: what is no longer
    known is of an aircraft that is no more, and the moment of its change, with all that it shook, spoils what follows.
    """
    accuracy = state.settings.accuracy
    state.missing = tuple(n for n in state.settings.derivatives if not precision.get(n, math.inf) <= accuracy)
    if state.active:
        if state.spoilt and time - state.begun >= CALM:
            state.spoilt = False
            _log(state, time, "estimates begun anew")
            return True
        if not (state.missing or state.spoilt):
            _end(state, time, "known")
        return False
    # what was known well enough once need not be better: only what is not known at all is flown for again
    lost = [n for n in state.settings.derivatives if not math.isfinite(precision.get(n, math.inf))]
    state.unknown_since = (time if math.isnan(state.unknown_since) else state.unknown_since) if lost else math.nan
    if state.armed and time - state.unknown_since >= AGAIN:
        state.begun, state.spoilt = time, True
        _log(state, time, f"begun again: {', '.join(lost)} no longer known")
    return False


def step(state: ExciterState, time: float, flight: FlightCondition) -> Array:
    """Deflections (controls,) rad on top of the commands at a time (s)."""
    if state.active:
        danger = _danger(state, flight)
        if danger:
            stop(state, time, f"aborted: {danger}")
        elif time - state.begun > state.settings.longest:
            stop(state, time, f"given up: {', '.join(state.missing)} not known")
    if not state.active:
        return np.zeros(state.table.shape[1])
    row: Array = state.table[round(max(time - state.begun, 0.0) * RATE) % len(state.table)]
    return row


def _danger(state: ExciterState, flight: FlightCondition) -> str:
    """The limit that is passed or the sensor that is silent, if any."""
    s, reference = state.settings, state.aircraft.reference.airspeed
    limits = {
        "roll": (-s.largest_roll, s.largest_roll),
        "pitch": (-s.largest_pitch, s.largest_pitch),
        "airspeed": (s.least_airspeed * reference, s.most_airspeed * reference),
        "load_factor": (s.least_load_factor, s.most_load_factor),
    }
    for name, (lower, upper) in limits.items():
        value = getattr(flight, name)
        if not math.isfinite(value):
            return f"{name.replace('_', ' ')} not measured"
        if not lower <= value <= upper:
            return f"{name.replace('_', ' ')} {value:.3g} beyond {lower:.3g} to {upper:.3g}"
    return ""


def _end(state: ExciterState, time: float, why: str) -> None:
    _log(state, time, f"{why} after {time - state.begun:.1f} s")
    state.begun = state.unknown_since = math.nan
    state.spoilt = False


def _log(state: ExciterState, time: float, text: str) -> None:
    state.events.append(ExcitationEvent(time, text))
    del state.events[:-EVENTS]
