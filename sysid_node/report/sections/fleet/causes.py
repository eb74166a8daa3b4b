"""Causes of the gap over the fleet: the simulator's, or one tail's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.fleet.statistics.causes import PooledCause, Size, TailCause
from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.wording.causes import in_pilots_units, label_words, parameter_words, units_of
from sysid_node.report.wording.fleet import account_words, date_words
from sysid_node.report.wording.names import unit
from sysid_node.report.wording.numbers import NONE, likely, number, plural


def context(report: FleetReport) -> dict[str, Any]:
    """A table of the causes, and one of causes by tail, for each type."""
    diagnosed = sum(flight.gap is not None for flight in report.results.flights)
    of_type: dict[str, list[PooledCause]] = {}
    for cause in report.summary.causes:
        of_type.setdefault(cause.aircraft, []).append(cause)
    types = [
        (aircraft, [_row(c) for c in causes if c.account != "flight"], _by_tail(causes), _of_flights(causes))
        for aircraft, causes in of_type.items()
    ]
    return {"types": types, "diagnosed": diagnosed}


def _row(cause: PooledCause) -> dict[str, Any]:
    return {
        "label": label_words(cause.label),
        "shared": likely(cause.shared),
        "account": account_words(cause),
        "sizes": _sizes(cause.label, cause.sizes),
        "confused": [f"{label_words(name)} ({likely(p)})" for name, p in cause.confused_with.items() if p >= 0.005],
    }


def _of_flights(causes: list[PooledCause]) -> list[str]:
    """Causes that belong to neither the type nor a tail, with the number of flights that named them."""
    counts = [(c.label, sum(tail.found for tail in c.tails)) for c in causes if c.account == "flight"]
    return [f"{label_words(label)} ({plural(count, 'flight')})" for label, count in counts if count]


def _by_tail(causes: list[PooledCause]) -> list[dict[str, Any]]:
    """A row for each tail and cause that it has with an even chance, the tails' own first."""
    rows = [_tail_row(c, t) for c in causes for t in c.tails if t.probability >= 0.5]
    return sorted(rows, key=lambda row: (not row["alone"], row["label"], row["tail"]))


def _tail_row(cause: PooledCause, tail: TailCause) -> dict[str, Any]:
    return {
        "tail": tail.tail,
        "label": label_words(cause.label),
        "alone": tail.own >= 0.5,
        "probability": likely(tail.probability),
        "found": f"{tail.found} of {tail.flights}",
        "since": "" if tail.since is None else date_words(tail.since),
        "total": _sizes(cause.label, tail.sizes),
        "shared": _sizes(cause.label, tail.shared_sizes) if cause.shared >= 0.5 else NONE,
        "own": _sizes(cause.label, tail.own_sizes),
    }


def _sizes(label: str, sizes: Mapping[str, Size]) -> str:
    """``angle of attack 1.2 (0.8 to 1.6) deg``, for each parameter of the cause."""
    units = units_of(label.partition(" of ")[0])
    return "; ".join(_size(name, size, units.get(name, unit(name))) for name, size in sizes.items()) or NONE


def _size(name: str, size: Size, si_unit: str) -> str:
    factor, _, shown = in_pilots_units(1.0, 0.0, si_unit)
    value, lower, upper = (number(factor * v, 2) for v in (size.value, size.lower, size.upper))
    between = f" ({lower} to {upper})" if size.lower <= size.upper else ""  # NaN where there is no interval
    return f"{parameter_words(name)} {value}{between} {shown}".rstrip()
