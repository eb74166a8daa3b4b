"""From the flights' results to what the fleet tells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import stats

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.fleet.results import FleetResults, FlightResult
from sysid_node.fleet.statistics.causes import pooled_causes
from sysid_node.fleet.statistics.drift import Drift
from sysid_node.fleet.statistics.false_discovery import FALSE_RATE, adjusted
from sysid_node.fleet.statistics.fleet_drift import TailKey, fleet_drifts, known_changes, without_drift
from sysid_node.fleet.statistics.joint import JointEffects, fit_joint
from sysid_node.fleet.statistics.population import Population, population_of
from sysid_node.fleet.statistics.prior import TailPrior, tail_prior
from sysid_node.fleet.statistics.series import series_by_type
from sysid_node.fleet.statistics.summary import (
    FileDifference,
    FleetSummary,
    Key,
    TailDeviation,
    count_reasons,
)

#: Tolerances of the file and errors beyond which a difference from it is not expected.
_EXPECTED = 2.0


def summarise(results: FleetResults, files: Mapping[str, Aircraft] | None = None) -> FleetSummary:
    """What the flights tell together: populations, drift, causes, and the next flight's prior of each tail.

    ``files`` are the aircraft files by type, with which the means of the types are compared; a type without a file is
    not compared. Derivatives drift, stand out or differ from the file by tests over the whole fleet of which a share of
    ``FALSE_RATE`` is false at most. Everything is computed from the results alone, and the same results give the same
    summary.
    """
    series = series_by_type(results.flights)
    drifts = fleet_drifts(series, results.maintenance)
    populations = {key: population_of(without_drift(each, drifts)) for key, each in series.items()}
    tails: dict[str, tuple[str, ...]] = {}
    for flight in results.flights:
        tails[flight.aircraft] = tuple(sorted({*tails.get(flight.aircraft, ()), flight.tail}))
    return FleetSummary(
        len(results.flights),
        tails,
        populations,
        tuple(_joint(results.flights, tails)),
        _deviations(populations),
        drifts,
        _differences(populations, files or {}),
        tuple(pooled_causes(results.flights, known_changes(tails, drifts, results.maintenance))),
        _priors(populations, drifts),
        count_reasons([refusal.reason for refusal in results.refusals]),
    )


def _joint(flights: Sequence[FlightResult], tails: Mapping[str, Sequence[str]]) -> list[JointEffects]:
    """The joint model of each type and coefficient."""
    found = []
    for aircraft in tails:
        mine = [flight for flight in flights if flight.aircraft == aircraft]
        names = tuple(dict.fromkeys(name for flight in mine for name in flight.names))
        for coefficient in COEFFICIENTS:
            of_one = tuple(name for name in names if name.partition("_")[0] == coefficient)
            joint = fit_joint(mine, of_one) if len(of_one) > 1 else None
            if joint is not None:
                found.append(joint)
    return found


def _deviations(populations: Mapping[Key, Population]) -> dict[TailKey, TailDeviation]:
    rows = [
        ((p.series.aircraft, tail, p.series.name), float(p.apart[j]), float(p.apart_error[j]), float(p.apart_p[j]))
        for p in populations.values()
        for j, tail in enumerate(p.series.tails)
        if np.isfinite(p.apart_p[j])
    ]
    levels = adjusted(np.array([row[-1] for row in rows]))
    return {
        key: TailDeviation(*key, distance, error, float(p), bool(p <= FALSE_RATE))
        for (key, distance, error, _), p in zip(rows, levels, strict=True)
    }


def _differences(populations: Mapping[Key, Population], files: Mapping[str, Aircraft]) -> dict[Key, FileDifference]:
    rows = []
    for (aircraft, name), p in populations.items():
        derivative = files[aircraft].derivatives.get(name) if aircraft in files else None
        if derivative is None:
            continue
        difference, freedom = p.fit.mean - derivative.value, max(len(p.series.tails) - 1, 1)
        chance = 2.0 * stats.t.sf(abs(difference) / p.fit.total_error, freedom)
        reach = None if derivative.tolerance is None else _EXPECTED * np.hypot(derivative.tolerance, p.fit.total_error)
        within = None if reach is None else bool(abs(difference) <= reach)
        rows.append(((aircraft, name), derivative.value, difference, p.fit.total_error, within, float(chance)))
    levels = adjusted(np.array([row[-1] for row in rows]))
    return {
        key: FileDifference(*key, value, difference, error, float(p), bool(p <= FALSE_RATE), within)
        for (key, value, difference, error, within, _), p in zip(rows, levels, strict=True)
    }


def _priors(
    populations: Mapping[Key, Population], drifts: Mapping[TailKey, Drift]
) -> dict[tuple[str, str], dict[str, TailPrior]]:
    """The prior of every tail's next flight, by derivative."""
    found: dict[tuple[str, str], dict[str, TailPrior]] = {}
    for (aircraft, name), population in populations.items():
        for tail in population.series.tails:
            drift = drifts.get((aircraft, tail, name))
            moved = drift if drift is not None and drift.significant else None
            found.setdefault((aircraft, tail), {})[name] = tail_prior(population, tail, moved)
    return found
