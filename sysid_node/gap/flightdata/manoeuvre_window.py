"""A flight cut down to its only manoeuvre.

A single flight is validated on parts of itself. If it holds one short manoeuvre, most parts are quiet, and without the
part that holds the manoeuvre nothing could be fitted. So the quiet parts are cut off, and the manoeuvre itself is
divided.

Steps show where a manoeuvre is. A smooth one has none, or only where it ends or the throttle is moved. So nothing is
cut off in which some control moves far more than in what would be kept.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flightdata.gap_flight import ANALYSIS_RATE, SHORTEST_FLIGHT, GapFlight, resampled
from sysid_node.gap.thresholds import THRESHOLDS


def step_changes(commands: Array) -> Array:
    """Changes (N, controls) of commands from sample to sample, zero where they are not much faster than usual."""
    changes = np.diff(commands, axis=0, prepend=commands[:1])
    return np.where(np.abs(changes) > THRESHOLDS.manoeuvre.sudden * np.median(np.abs(changes), axis=0), changes, 0.0)


def cut_to_manoeuvre(flight: GapFlight, controls: tuple[str, ...]) -> GapFlight:
    """The part of the flight with its only manoeuvre, if that is a small part of it; else the flight itself."""
    record = resampled(flight)
    moved = [name for name in (*controls, *(["thrust"] if flight.metered else [])) if name in record.columns]
    commands = np.column_stack([record[name] for name in moved])
    steps = step_changes(commands) ** 2
    power = (steps / np.maximum(steps.sum(axis=0), 1e-300)).sum(axis=1).cumsum()
    if not power[-1] > 0.0:
        return flight
    limits = THRESHOLDS.manoeuvre
    aside = 0.5 * (1.0 - limits.share_of_changes)
    first, last = np.searchsorted(power / power[-1], [aside, 1.0 - aside]) / ANALYSIS_RATE
    end = min(max(last + limits.after, first - limits.before + SHORTEST_FLIGHT), record.duration)
    begin = max(min(first - limits.before, end - SHORTEST_FLIGHT), 0.0)
    if end - begin > limits.share_of_flight * record.duration:
        return flight
    kept = (record.time >= begin) & (record.time <= end)
    if (commands[~kept].var(axis=0) > limits.elsewhere * commands[kept].var(axis=0)).any():
        return flight
    return replace(
        flight,
        record=_between(flight.record, begin, end),
        history=flight.history and flight.history.between(begin, end),
        left_out=flight.record.duration - (end - begin),
        begin=flight.begin + begin,
    )


def _between(record: FlightRecord, begin: float, end: float) -> FlightRecord:
    """The part of a record between two times, s; its own time begins at zero."""
    kept = (record.time >= begin) & (record.time <= end)
    columns = {name: values[kept] for name, values in record.columns.items()}
    start = record.start_ns + round(1e9 * begin)
    return FlightRecord(record.time[kept] - record.time[kept][0], columns, record.name, start, record.rejected)
