"""Flights cut where the recording was interrupted, because no model can be integrated across an interruption.

The stretches count as flights of their own: each has its own initial state, and no filter reaches from one to another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import FlightRecord

#: No step of fewer usual ones than this is an interruption, however slow the record is.
_USUAL_STEPS = 5.0

#: A stretch of fewer samples, or seconds, tells no more of the motion than of its own initial state.
_FEWEST, _SHORTEST = 20, 2.0

#: A stretch that is never as fast as this share of the flight's highest airspeed is not flown.
_SLOW = 0.3


def stretches(record: FlightRecord, needed: Sequence[str], longest: float) -> tuple[list[FlightRecord], list[str]]:
    """The record cut at interruptions longer than ``longest`` s, and remarks on what was done.

    Samples at which one of the ``needed`` columns is missing are left out first, if they are at most half of all;
    columns that were never measured do not count. Stretches that are short, that are not flown, or that lack a column
    which the rest of the flight has, are left out. The time of each begins at zero. A record without interruptions is
    returned as it is; so is one of which no stretch is left.
    """
    measured = [name for name in needed if record.measured(name)]
    complete = np.isfinite(np.array([record.time, *(record[name] for name in measured)])).all(axis=0)
    if 2 * int(complete.sum()) < len(record):
        return [record], []
    whole, remarks = record, []
    if not complete.all():
        names = [name for name in measured if not np.isfinite(record[name]).all()]
        missing = f"{int((~complete).sum())} of {len(record)} samples lack a value of {', '.join(names)}"
        remarks.append(f"{record.name}: {missing}, and were left out")
        whole = _at(record, complete, record.name)
    return _cut(whole, longest, remarks)


def interruptions_in_words(record: FlightRecord, longest: float) -> str:
    """How often the recording is interrupted for longer than ``longest`` s, and for how long in all; empty if never."""
    places = _interruptions(record, longest)
    if not places.size:
        return ""
    often = "once" if places.size == 1 else f"{places.size} times"
    lost = float(np.diff(record.time)[places].sum())
    return f"{record.name}: the recording is interrupted {often}, for {lost:.3g} of {record.duration:.3g} s in all"


def _interruptions(record: FlightRecord, longest: float) -> NDArray[np.intp]:
    """The last sample before each interruption."""
    steps = np.diff(record.time)
    return np.flatnonzero(steps > max(longest, _USUAL_STEPS * float(np.median(steps))))


def _cut(record: FlightRecord, longest: float, remarks: list[str]) -> tuple[list[FlightRecord], list[str]]:
    edges = [0, *(_interruptions(record, longest) + 1).tolist(), len(record)]
    parts = [slice(first, last) for first, last in pairwise(edges) if _is_usable(record, first, last)]
    if len(edges) == 2 or not parts:
        return [record], remarks
    used = sum(float(record.time[part][-1] - record.time[part][0]) for part in parts)
    stretches_used = f"{len(parts)} stretches of {used:.3g} s together are" if len(parts) > 1 else f"{used:.3g} s are"
    remarks.append(f"{interruptions_in_words(record, longest)}; {stretches_used} used")
    names = [f"{record.name} [{k + 1}/{len(parts)}]" for k in range(len(parts))] if len(parts) > 1 else [record.name]
    return [_at(record, part, name) for part, name in zip(parts, names, strict=True)], remarks


def _is_usable(record: FlightRecord, first: int, last: int) -> bool:
    """Whether a stretch is long enough, is flown, and has all that was measured in the flight."""
    if last - first < _FEWEST or record.time[last - 1] - record.time[first] < _SHORTEST:
        return False
    if record.measured("V") and not np.nanmax(record["V"][first:last], initial=0.0) > _SLOW * np.nanmax(record["V"]):
        return False
    measured = (values[first:last] for name, values in record.columns.items() if record.measured(name))
    return all(np.isfinite(values).any() for values in measured)


def _at(record: FlightRecord, rows: slice | NDArray[np.bool_], name: str) -> FlightRecord:
    """The record at these rows, its time beginning at zero."""
    columns = {key: values[rows] for key, values in record.columns.items()}
    time = record.time[rows]
    start = record.start_ns + round(1e9 * float(time[0]))
    return replace(record, time=time - time[0], columns=columns, name=name, start_ns=start)
