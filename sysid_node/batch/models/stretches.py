"""Flights cut where the recording was interrupted, because no model can be integrated across an interruption.

The stretches count as flights of their own: each has its own initial state, and no filter reaches from one to another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import (
    FlightRecord,
    interrupted_in_words,
    lacking_in_words,
    rows_with_values,
    uninterrupted_parts,
)

#: A stretch of fewer samples, or seconds, tells of little more than its own initial state.
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
    complete, names = rows_with_values(record, needed)
    if 2 * int(complete.sum()) < len(record):
        return [record], []
    whole, remarks = record, []
    if names:
        remarks.append(f"{record.name}: {lacking_in_words(complete, names)}, and were left out")
        whole = _at(record, complete, record.name)
    return _cut(whole, longest, remarks)


def interruptions_in_words(record: FlightRecord, longest: float) -> str:
    """How often the recording is interrupted for longer than ``longest`` s, and for how long in all; empty if never."""
    parts = uninterrupted_parts(record.time, longest)
    if len(parts) == 1:
        return ""
    lost = record.duration - sum(_seconds(record, part) for part in parts)
    return f"{record.name}: {interrupted_in_words(len(parts))}, for {lost:.3g} of {record.duration:.3g} s in all"


def _cut(record: FlightRecord, longest: float, remarks: list[str]) -> tuple[list[FlightRecord], list[str]]:
    """The usable parts between interruptions, and the ``remarks`` with one on them."""
    parts = uninterrupted_parts(record.time, longest)
    usable = [part for part in parts if _is_usable(record, part)]
    if len(parts) == 1 or not usable:
        return [record], remarks
    used = f"{sum(_seconds(record, part) for part in usable):.3g} s"
    said = f"{used} are" if len(usable) == 1 else f"{len(usable)} stretches of {used} together are"
    names = [f"{record.name} [{k + 1}/{len(usable)}]" for k in range(len(usable))]
    if len(usable) == 1:
        names = [record.name]
    cut = [_at(record, part, name) for part, name in zip(usable, names, strict=True)]
    return cut, [*remarks, f"{interruptions_in_words(record, longest)}; {said} used"]


def _seconds(record: FlightRecord, part: slice) -> float:
    """How long a part is."""
    return float(np.ptp(record.time[part]))


def _is_usable(record: FlightRecord, part: slice) -> bool:
    """Whether a part is long enough, is flown, and has all that was measured in the flight."""
    if record.time[part].size < _FEWEST or _seconds(record, part) < _SHORTEST:
        return False
    if record.measured("V") and not np.nanmax(record["V"][part], initial=0.0) > _SLOW * np.nanmax(record["V"]):
        return False
    measured = (values[part] for name, values in record.columns.items() if record.measured(name))
    return all(np.isfinite(values).any() for values in measured)


def _at(record: FlightRecord, rows: slice | NDArray[np.bool_], name: str) -> FlightRecord:
    """The record at these rows, its time beginning at zero."""
    columns = {key: values[rows] for key, values in record.columns.items()}
    time = record.time[rows]
    start = record.start_ns + round(1e9 * float(time[0]))
    return replace(record, time=time - time[0], columns=columns, name=name, start_ns=start)
