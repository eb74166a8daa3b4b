"""A flight alone is checked on its own parts; where only one of them moves, that one is parted.

Most of a flight with a single manoeuvre is quiet. With the manoeuvre left out nothing could be fitted, so nothing that
was fitted could be checked: the quiet goes, and the manoeuvre itself is fitted by parts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flightdata.gap_flight import ANALYSIS_RATE, SHORTEST_FLIGHT, GapFlight, resampled
from sysid_node.gap.thresholds import THRESHOLDS


def step_changes(commands: Array) -> Array:
    """Changes (N, controls) of commands from sample to sample, zero where they are no faster than usual."""
    changes = np.diff(commands, axis=0, prepend=commands[:1])
    return np.where(np.abs(changes) > THRESHOLDS.manoeuvre.sudden * np.median(np.abs(changes), axis=0), changes, 0.0)


def cut_to_manoeuvre(flight: GapFlight, controls: tuple[str, ...]) -> GapFlight:
    """The flight's only manoeuvre, where there is one and it is a small part of the flight; else the flight."""
    record = resampled(flight)
    moved = [name for name in (*controls, *(["thrust"] if flight.metered else [])) if name in record.columns]
    steps = step_changes(np.column_stack([record[name] for name in moved])) ** 2
    power = (steps / np.maximum(steps.sum(axis=0), 1e-300)).sum(axis=1).cumsum()
    if not power[-1] > 0.0:
        return flight
    limits = THRESHOLDS.manoeuvre
    aside = 0.5 * (1.0 - limits.share_of_changes)
    first, last = np.searchsorted(power / power[-1], [aside, 1.0 - aside]) / ANALYSIS_RATE
    begin = max(first - limits.before, 0.0)
    end = min(max(last + limits.after, first - limits.before + SHORTEST_FLIGHT), record.duration)
    if end - begin > limits.share_of_flight * record.duration:
        return flight
    return replace(flight, record=_between(flight.record, begin, end), left_out=flight.record.duration - (end - begin))


def _between(record: FlightRecord, begin: float, end: float) -> FlightRecord:
    """Part of a record, its time from zero; begin and end in s."""
    kept = (record.time >= begin) & (record.time <= end)
    columns = {name: values[kept] for name, values in record.columns.items()}
    start = record.start_ns + round(1e9 * begin)
    return FlightRecord(record.time[kept] - record.time[kept][0], columns, record.name, start, record.rejected)
