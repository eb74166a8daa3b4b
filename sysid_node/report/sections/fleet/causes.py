"""Causes of the gap over the fleet: the simulator's, or one tail's."""

from __future__ import annotations

from typing import Any

from sysid_node.fleet.statistics.causes import PooledCause, Size, TailCause
from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.wording.fleet import account_words, date_words
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
        "label": cause.label,
        "shared": likely(cause.shared),
        "account": account_words(cause),
        "sizes": [f"{name} {_size(size)}" for name, size in cause.sizes.items()],
        "confused": [f"{name} ({likely(p)})" for name, p in cause.confused_with.items() if p >= 0.005],
    }


def _of_flights(causes: list[PooledCause]) -> list[str]:
    """Causes that belong to neither the type nor a tail, with the number of flights that named them."""
    counts = [(c.label, sum(tail.found for tail in c.tails)) for c in causes if c.account == "flight"]
    return [f"{label} ({plural(count, 'flight')})" for label, count in counts if count]


def _by_tail(causes: list[PooledCause]) -> list[dict[str, Any]]:
    """A row for each tail and cause that it has with an even chance, the tails' own first."""
    rows = [_tail_row(c, t) for c in causes for t in c.tails if t.probability >= 0.5]
    return sorted(rows, key=lambda row: (not row["alone"], row["label"], row["tail"]))


def _tail_row(cause: PooledCause, tail: TailCause) -> dict[str, Any]:
    return {
        "tail": tail.tail,
        "label": cause.label,
        "alone": tail.own >= 0.5,
        "probability": likely(tail.probability),
        "found": f"{tail.found} of {tail.flights}",
        "since": "" if tail.since is None else date_words(tail.since),
        "total": _sizes(tail.sizes),
        "shared": _sizes(tail.shared_sizes) if cause.shared >= 0.5 else NONE,
        "own": _sizes(tail.own_sizes),
    }


def _sizes(sizes: dict[str, Size]) -> str:
    return "; ".join(f"{name} {_size(size)}" for name, size in sizes.items()) or NONE


def _size(size: Size) -> str:
    """``0.10 (0.08 to 0.12)``."""
    return f"{number(size.value, 2)} ({number(size.lower, 2)} to {number(size.upper, 2)})"
