"""Flights recorded in a simulator: whether they suffice to identify it, and the part of them that is held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flightdata.gap_flight import GapFlight, travel

#: Shortest simulated flight in all, s: every axis once, and as much again to check on.
SHORTEST = 30.0

#: Travel of a control below which a simulated flight says nothing of it, rad.
_LEAST_TRAVEL = 0.01

#: Share of the simulated flights that is held out where these are not divided by flights.
_HELD_OUT = 1.0 / 3.0

#: Share of a flight's distinct samples that must be another's for both to be the same recording.
_SAME = 0.5


def require_simulated(simulated: Sequence[GapFlight], real: Sequence[GapFlight]) -> None:
    """Raises InputError where a simulated flight is a real one, or where there is too little simulated flight."""
    for flight in simulated:
        for other in real:
            if flight.source == other.source or _same_recording(flight.record, other.record):
                raise InputError(
                    f"--simulated {flight.source}: is the same recording as {other.source}; give a bag that was "
                    "recorded in the simulator"
                )
    total = sum(flight.record.duration for flight in simulated)
    if total < SHORTEST:
        raise InputError(
            f"--simulated {_sources(simulated)}: {total:.0f} s of simulated flight; the simulator cannot be identified "
            f"from less than {SHORTEST:g} s; fly 3-2-1-1 steps on each surface twice (sysid excite designs them)"
        )


def _same_recording(one: FlightRecord, other: FlightRecord) -> bool:
    """Whether most of the distinct samples of one flight's inertial instruments are also those of another."""
    samples, others = ({row.tobytes() for row in _inertial(record)} for record in (one, other))
    return len(samples & others) > _SAME * len(samples)


def _inertial(record: FlightRecord) -> Array:
    """Specific force and angular rates (N, 6)."""
    return np.ascontiguousarray(np.column_stack([record[name] for name in ("ax", "ay", "az", "p", "q", "r")]))


def split(aircraft: Aircraft, simulated: Sequence[GapFlight]) -> tuple[list[GapFlight], list[GapFlight]]:
    """The simulated flights that the simulator is identified from, and those held out.

    Of several flights the last is held out, where the others move every control; else the last third of each flight.
    Raises InputError where a control is not moved in what is left to identify from.
    """
    if len(simulated) > 1 and not _unmoved(aircraft, simulated[:-1]) and _unmoved(aircraft, simulated[-1:]) == []:
        return list(simulated[:-1]), [simulated[-1]]
    cuts = [(1.0 - _HELD_OUT) * flight.record.duration for flight in simulated]
    first = [_part(flight, 0.0, cut) for flight, cut in zip(simulated, cuts, strict=True)]
    last = [_part(flight, cut, np.inf) for flight, cut in zip(simulated, cuts, strict=True)]
    _require_moved(aircraft, simulated, first)
    return first, last


def _require_moved(aircraft: Aircraft, simulated: Sequence[GapFlight], fitted: Sequence[GapFlight]) -> None:
    """Raises InputError where a control hardly moves."""
    for names, where, remedy in (
        (_unmoved(aircraft, simulated), "", "fly 3-2-1-1 steps on it in the simulator, twice"),
        (_unmoved(aircraft, fitted), " but in their last third, which is held out", "repeat the manoeuvre"),
    ):
        if names:
            raise InputError(
                f"--simulated {_sources(simulated)}: the simulated flights hardly move {', '.join(names)}{where}; "
                f"{remedy} (sysid excite designs it)"
            )


def _unmoved(aircraft: Aircraft, flights: Sequence[GapFlight]) -> list[str]:
    """Names of the controls that none of these flights moves."""
    return [
        control.name
        for control in aircraft.controls.values()
        if max(float(travel(flight.record[control.symbol])) for flight in flights) < _LEAST_TRAVEL
    ]


def _part(flight: GapFlight, begin: float, end: float) -> GapFlight:
    """The part of a flight between two times, s; its own time begins at zero."""
    record = flight.record
    kept = (record.time >= begin) & (record.time < end)
    columns = {name: values[kept] for name, values in record.columns.items()}
    start = record.start_ns + round(1e9 * float(record.time[kept][0]))
    time = record.time[kept] - record.time[kept][0]
    part = FlightRecord(time, columns, record.name, start, record.rejected)
    return replace(flight, record=part, history=flight.history and flight.history.between(begin, end))


def _sources(flights: Sequence[GapFlight]) -> str:
    return ", ".join(flight.source for flight in flights)
