"""Excitation in flight: small deflections added to a pilot's or autopilot's commands until the estimates are accurate.

    state = init(aircraft, settings)
    start(state, time)
    deflections = step(state, time, flight)        # (controls,) rad, at every command
    receive_estimates(state, time, precision)      # whenever estimates come
    receive_faults(state, time, faults)            # whenever faults are reported

It stops when the derivatives asked for are accurate enough. With the setting ``watch`` it begins again when one of them
is no longer valid, and when a fault of a surface or of the airframe is reported. It stops at once, with no deflection,
where a limit is exceeded or a sensor is silent. ``events`` lists what it did and when.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.excite.exciter_settings import ExcitationSettings
from sysid_node.excite.segment import draw_manoeuvre
from sysid_node.excite.spec import parse_segments

Array = NDArray[np.float64]

RATE = 200.0  # Hz, at which the manoeuvre is sampled
RESET_DELAY = 1.5  # s of renewed excitation after which the estimates are reset
INVALID_TIME = 0.5  # s for which a derivative must be invalid before excitation begins again
LOST_TIME = 2.0  # s for which it must be, while excitation is under way, before the estimates are reset
LEAST_BETWEEN_RESETS = 15.0  # s, so that estimates have the time to become valid
EVENTS = 1000  # number of events that are kept
UNDER_WAY = "excitation is under way"


class LimitedQuantities(NamedTuple):
    """The quantities that have limits; NaN = not measured."""

    roll: float  # rad
    pitch: float  # rad
    airspeed: float  # m/s
    load_factor: float


class ExcitationEvent(NamedTuple):
    """What the exciter did at a time (s)."""

    time: float
    text: str


@dataclass
class EstimateWatch:
    """What is known of the estimates of the derivatives that are asked for."""

    missing: tuple[str, ...] = ()  # derivatives that are not accurate enough
    unknown_since: float = math.nan  # s, since when one of them is no longer valid; NaN: all are
    known: frozenset[str] = frozenset()  # derivatives that have been valid since the last reset
    outdated_since: float = math.nan  # s, since when estimates use data from before a change; NaN: they do not
    reset_at: float = -math.inf  # s, of the last reset of the estimates

    @property
    def outdated(self) -> bool:
        """Whether the estimates use data from before a change of the aircraft."""
        return not math.isnan(self.outdated_since)


@dataclass
class ExciterState:
    """The state of an exciter."""

    aircraft: Aircraft
    settings: ExcitationSettings
    table: Array  # (N, controls) rad at RATE
    estimates: EstimateWatch
    events: list[ExcitationEvent] = field(default_factory=list)  # the last ``EVENTS``
    happened: int = 0  # number of all events
    begun: float = math.nan  # s; NaN = not exciting
    armed: bool = False  # whether excitation may begin again when a derivative is no longer valid
    watching: bool = False  # whether it may when a fault is reported: also after it was given up
    faults: frozenset[str] = frozenset()  # that are reported now

    @property
    def active(self) -> bool:
        """Whether excitation is under way."""
        return not math.isnan(self.begun)


def init(aircraft: Aircraft, settings: ExcitationSettings) -> ExciterState:
    """The state before excitation. Raises InputError on a manoeuvre or derivative that the aircraft does not have."""
    unknown = [name for name in settings.derivatives if name not in aircraft.derivatives]
    if unknown:
        raise InputError(f"derivatives: aircraft {aircraft.name!r} has no {', '.join(unknown)}")
    segments = parse_segments(settings.manoeuvre, aircraft)
    end = max(segment.end for segment in segments)
    drawn = draw_manoeuvre(segments, aircraft, RATE, end)
    table = np.column_stack([drawn.deflections[name] for name in aircraft.controls])
    if np.abs(table).max() > settings.largest_amplitude:
        raise InputError(
            f"manoeuvre {drawn.name!r}: moves {np.abs(table).max():.3g} rad, more than the largest amplitude "
            f"{settings.largest_amplitude:g}; lower it"
        )
    return ExciterState(aircraft, settings, table, EstimateWatch(settings.derivatives))


def start(state: ExciterState, time: float, flight: LimitedQuantities | None = None) -> None:
    """Begins excitation at a time (s).

    Raises InputError where it is under way already, or would be aborted at once, as the ``flight`` exceeds a limit.
    """
    if state.active:
        raise InputError(f"{UNDER_WAY}; stop it first")
    exceeded = _exceeded_limit(state, flight) if flight is not None else ""
    if exceeded:
        raise InputError(f"{exceeded}: excitation would be aborted at once")
    state.begun, state.armed, state.watching = time, state.settings.watch, state.settings.watch
    _log(state, time, "begun")


def stop(state: ExciterState, time: float, why: str) -> None:
    """Ends excitation at a time (s); it does not begin again by itself."""
    if state.active:
        _end(state, time, why)
    state.armed = state.watching = False


def receive_estimates(state: ExciterState, time: float, precision: Mapping[str, float]) -> bool:
    """Whether the estimates should be reset, given their ``precision`` at a time (s).

    ``precision``: half of each 95 % interval over the size of its derivative, infinite where it is not valid. A reset
    is asked for once each time that excitation begins again by itself, and where a derivative that was valid is not any
    more while excitation is under way: the aircraft has changed, and data from before and during the change bias the
    estimates. Without the reset they may contradict each other for as long as the data from before count.
    """
    accuracy = state.settings.accuracy
    state.estimates.missing = tuple(n for n in state.settings.derivatives if not precision.get(n, math.inf) <= accuracy)
    # excitation begins again for invalid derivatives only, not for those that have become less accurate
    invalid = [n for n in state.settings.derivatives if not math.isfinite(precision.get(n, math.inf))]
    lost = sorted(state.estimates.known.intersection(invalid)) if state.active else invalid
    state.estimates.known |= frozenset(state.settings.derivatives) - frozenset(invalid)
    state.estimates.unknown_since = (
        (time if math.isnan(state.estimates.unknown_since) else state.estimates.unknown_since) if lost else math.nan
    )
    if state.active:
        return _judge_active(state, time, lost)
    if state.armed and time - state.estimates.unknown_since >= INVALID_TIME:
        _begin_again(state, time, f"{', '.join(lost)} no longer known")
    return False


def receive_faults(state: ExciterState, time: float, faults: Iterable[str]) -> None:
    """Take the faults of surfaces and of the airframe that are reported at a time (s), in words that do not change.

    Faults are found sooner than the estimates notice a change: without excitation little tells the old aircraft from
    the new one, and estimates stay valid although they are wrong.
    """
    new, state.faults = sorted(set(faults) - state.faults), frozenset(faults)
    if not new or not state.watching:
        return
    if state.active:
        state.estimates.outdated_since = time
        _log(state, time, f"goes on: {', '.join(new)}")
    else:
        _begin_again(state, time, ", ".join(new))
        state.armed = True


def _judge_active(state: ExciterState, time: float, lost: Sequence[str]) -> bool:
    """Whether the estimates should be reset while excitation is under way; ends it where all is known."""
    may_reset = time - state.estimates.reset_at >= LEAST_BETWEEN_RESETS
    if state.armed and may_reset and not state.estimates.outdated and time - state.estimates.unknown_since >= LOST_TIME:
        state.estimates.outdated_since = time
        _log(state, time, f"goes on: {', '.join(lost)} no longer known")
    if state.estimates.outdated and time - state.estimates.outdated_since >= RESET_DELAY:
        state.estimates.outdated_since, state.estimates.unknown_since = math.nan, math.nan
        state.estimates.reset_at, state.estimates.known = time, frozenset()
        _log(state, time, "estimates begun anew")
        return True
    if not (state.estimates.missing or state.estimates.outdated):
        _end(state, time, "known")
    return False


def _begin_again(state: ExciterState, time: float, why: str) -> None:
    state.begun = state.estimates.outdated_since = time
    _log(state, time, f"begun again: {why}")


def step(state: ExciterState, time: float, flight: LimitedQuantities) -> Array:
    """The deflections (controls,) rad to be added to the commands at a time (s)."""
    if state.active:
        exceeded = _exceeded_limit(state, flight)
        if exceeded:
            stop(state, time, f"aborted: {exceeded}")
        elif time - state.begun > state.settings.longest:
            _end(state, time, f"given up: {', '.join(state.estimates.missing)} not known")
            state.armed = False
    if not state.active:
        return np.zeros(state.table.shape[1])
    row: Array = state.table[round(max(time - state.begun, 0.0) * RATE) % len(state.table)]
    return row


def _exceeded_limit(state: ExciterState, flight: LimitedQuantities) -> str:
    """The limit that is exceeded or the sensor that is silent, in words; empty where there is none."""
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
    state.begun = state.estimates.unknown_since = state.estimates.outdated_since = math.nan


def _log(state: ExciterState, time: float, text: str) -> None:
    state.events.append(ExcitationEvent(time, text))
    del state.events[:-EVENTS]
    state.happened += 1
