"""Drift over a whole fleet: every tail and derivative tested, with false alarms controlled over all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.fleet.results import MaintenanceNote
from sysid_node.fleet.statistics.drift import Drift, find_drift
from sysid_node.fleet.statistics.false_discovery import FALSE_RATE, adjusted
from sysid_node.fleet.statistics.random_effects import flight_scatter_of_others
from sysid_node.fleet.statistics.series import DAY, DerivativeSeries

TailKey = tuple[str, str, str]  # type, tail and derivative

#: Rounds of testing; after the first, the scatter of flights is taken without the drifts that were found.
_ROUNDS = 2


def fleet_drifts(
    series: Mapping[tuple[str, str], DerivativeSeries], maintenance: Sequence[MaintenanceNote] = ()
) -> dict[TailKey, Drift]:
    """The most significant drift of every tail and derivative, those marked that are significant over the whole fleet.

    ``series`` are by type and derivative. Each tail is held against the scatter of the other tails' flights.
    """
    found: dict[TailKey, Drift] = {}
    for _ in range(_ROUNDS):
        tested: dict[TailKey, Drift] = {}
        for each in series.values():
            tested |= _of_series(each, without_drift(each, found), maintenance)
        levels = adjusted(np.array([drift.p_value for drift in tested.values()]))
        found = {
            key: replace(drift, adjusted_p=float(p), significant=bool(p <= FALSE_RATE))
            for (key, drift), p in zip(tested.items(), levels, strict=True)
        }
    return found


def _of_series(
    series: DerivativeSeries, steady: DerivativeSeries, maintenance: Sequence[MaintenanceNote]
) -> dict[TailKey, Drift]:
    """The drifts of the tails of one series; ``steady`` are its values without the drifts that are known."""
    scatter = flight_scatter_of_others(steady.value, steady.statistical, steady.systematic, steady.tail)
    found = {}
    for j, tail in enumerate(series.tails):
        days = [note.date.timestamp() / DAY for note in maintenance if note.concerns(series.aircraft, tail)]
        drift = find_drift(series.of_tail(tail), float(scatter.value[j]), int(scatter.freedom[j]), days)
        if drift is not None:
            found[series.aircraft, tail, series.name] = drift
    return found


def without_drift(series: DerivativeSeries, drifts: Mapping[TailKey, Drift]) -> DerivativeSeries:
    """The estimates as they would be had no tail drifted from its first state; only significant drifts are removed."""
    value = series.value.copy()
    for j, tail in enumerate(series.tails):
        drift = drifts.get((series.aircraft, tail, series.name))
        if drift is not None and drift.significant:
            value[series.tail == j] -= drift.change * drift.course.values
    return series.with_values(value)


def known_changes(
    tails: Mapping[str, Sequence[str]], drifts: Mapping[TailKey, Drift], maintenance: Sequence[MaintenanceNote]
) -> dict[tuple[str, str], list[float]]:
    """By type and tail, the days since 1970 of maintenance and of the significant steps of its derivatives."""
    return {
        (aircraft, tail): [note.date.timestamp() / DAY for note in maintenance if note.concerns(aircraft, tail)]
        + [
            drift.course.since
            for key, drift in drifts.items()
            if key[:2] == (aircraft, tail) and drift.significant and drift.course.kind == "step"
        ]
        for aircraft, names in tails.items()
        for tail in names
    }
