"""Fleets drawn from the statistical model: the flights' estimates and diagnoses, and, sealed beside them, the truth.

Two types of ten tails, 10 to 15 flights a tail over a year. A type's derivatives lie about those of its aircraft file,
tails about their type, flights about their tail; estimates have statistical errors, correlated within a coefficient and
now and then four times as large, and systematic ones, of which half the variance is the type's and half the tail's.
The events: one tail wears, one has a slow servo, one a mis-set vane after maintenance, and the simulator lacks one
effect that all have. Every tail is inspected once, on a day that is drawn. A flight's diagnosis names a cause that is
there in 85 of 100 flights, a confused alternative in some of these, and in 4 of 100 a cause that is not there. Nothing
of how the estimates are judged enters here.
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.fleet.results import FleetResults, FlightResult, MaintenanceNote

Array = NDArray[np.float64]
Generator = np.random.Generator

TYPES = ("cdrw", "kestrel")
NAMES = ("CL_0", "CL_alpha", "Cm_0", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr")
START = datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC)
TAIL_SCATTER, FLIGHT_SCATTER, STATISTICAL, SYSTEMATIC = 0.04, 0.015, 0.03, 0.02  # of the derivative's size
WEAR, VANE, LAG, MOTOR = 0.18, 0.02, 0.08, 0.25  # share of aileron power; rad; s; s
LACKING, SLOW, VANE_CAUSE = "motor_lag", "actuator_lag of elevator", "vane_bias"
CONFUSED = {SLOW: "command_delay of elevator", LACKING: "thrust_scale"}
FALSE = ("imu_scale", "cg_shift", "airspeed_scale", "propwash", "stall_separation", "structural_mode")


@dataclass(frozen=True)
class Truth:
    """What was drawn: by type and derivative the mean, the scatters and the tails' values; and the events."""

    means: Mapping[tuple[str, str], float]
    tail_scatter: Mapping[tuple[str, str], float]
    flight_scatter: Mapping[tuple[str, str], float]
    tails: Mapping[tuple[str, str, str], float]
    worn: str = ""
    wear: float = 0.0  # share of its aileron power that the worn tail loses over the year
    slow: str = ""
    vane: str = ""
    since: float = 0.0  # day of the maintenance, of the year
    drifting: frozenset[tuple[str, str]] = field(default_factory=frozenset)  # tail and derivative
    systematic: Mapping[tuple[str, str], Array] = field(default_factory=dict)  # (n,) by type and tail, in errors


def draw_fleet(
    seed: int, *, events: bool = True, tails: int = 10, types: Sequence[str] = TYPES, wear: float = WEAR
) -> tuple[FleetResults, Truth]:
    """A fleet and its truth; ``wear`` is the share of its aileron power that the worn tail loses over the year."""
    generator = np.random.default_rng([seed, 24])
    files = {name: load_aircraft(name) for name in types}
    names = {(aircraft, j): f"{aircraft}-{j + 1:02d}" for aircraft in types for j in range(tails)}
    worn, slow, vane = generator.choice(sorted(names.values()), 3, replace=False) if events else ("", "", "")
    since = float(generator.uniform(120, 240))
    flights: list[FlightResult] = []
    truth = Truth({}, {}, {}, {}, str(worn), wear, str(slow), str(vane), since, _drifting(str(worn), str(vane)), {})
    for aircraft, file in files.items():
        flights += _fly_type(generator, aircraft, file, tails, truth, events)
    notes = [MaintenanceNote(str(vane), _date(since), "nose boom replaced")] if events else []
    days = np.random.default_rng([seed, 25]).uniform(0, 365, len(names))
    notes += [MaintenanceNote(tail, _date(day), "inspected") for tail, day in zip(names.values(), days, strict=True)]
    return FleetResults(tuple(sorted(flights, key=lambda f: (f.tail, f.date))), (), tuple(notes)), truth


def _drifting(worn: str, vane: str) -> frozenset[tuple[str, str]]:
    return frozenset({(worn, "Cl_da"), (vane, "CL_0"), (vane, "Cm_0")}) if worn else frozenset()


def sizes_of(file: Aircraft) -> Array:
    """The size (n,) to which each derivative's scatters and errors refer; an offset's is a tenth of its slope's."""
    values = {name: abs(file.derivatives[name].value) for name in NAMES}
    offsets = {name: 0.1 * values[name.replace("_0", "_alpha")] for name in NAMES if name.endswith("_0")}
    return np.array([offsets.get(name, values[name]) for name in NAMES])


def _fly_type(
    generator: Generator, aircraft: str, file: Aircraft, tails: int, truth: Truth, events: bool
) -> list[FlightResult]:
    sizes = sizes_of(file)
    mean = np.array([file.derivatives[n].value for n in NAMES]) + 0.05 * sizes * generator.standard_normal(sizes.size)
    of_type = generator.standard_normal(sizes.size)
    flights = []
    for k, name in enumerate(NAMES):
        truth.means[aircraft, name] = float(mean[k])  # type: ignore[index]
        truth.tail_scatter[aircraft, name] = float(TAIL_SCATTER * sizes[k])  # type: ignore[index]
        truth.flight_scatter[aircraft, name] = float(FLIGHT_SCATTER * sizes[k])  # type: ignore[index]
    for j in range(tails):
        tail = f"{aircraft}-{j + 1:02d}"
        value = mean + TAIL_SCATTER * sizes * generator.standard_normal(sizes.size)
        shift = np.sqrt(0.5) * (of_type + generator.standard_normal(sizes.size))
        truth.systematic[aircraft, tail] = shift  # type: ignore[index]
        for k, name in enumerate(NAMES):
            truth.tails[aircraft, tail, name] = float(value[k])  # type: ignore[index]
        days = np.sort(generator.uniform(0, 365, generator.integers(10, 16)))
        for i, day in enumerate(days):
            changed = value + _changes(file, tail, truth, float(day))
            flights.append(
                _flight(generator, f"{tail}/{i:02d}", aircraft, tail, changed, shift, sizes, truth, float(day), events)
            )
    return flights


def _changes(file: Aircraft, tail: str, truth: Truth, day: float) -> Array:
    """What wear and a mis-set vane add to a tail's derivatives (n,) on a day."""
    change = dict.fromkeys(NAMES, 0.0)
    if tail == truth.worn:
        change["Cl_da"] = -truth.wear * file.derivatives["Cl_da"].value * day / 365
    if tail == truth.vane and day >= truth.since:
        change["CL_0"] = -VANE * file.derivatives["CL_alpha"].value
        change["Cm_0"] = -VANE * file.derivatives["Cm_alpha"].value
    return np.array(list(change.values()))


def statistical_covariance(generator: Generator, sizes: Array) -> Array:
    """Covariance (n, n) of a flight's statistical errors: correlated by 0.4 within a coefficient."""
    hard = np.where(generator.random(sizes.size) < 0.15, 4.0, 1.0)
    error = STATISTICAL * sizes * hard * np.exp(0.3 * generator.standard_normal(sizes.size))
    same = np.array([[0.4 if a.partition("_")[0] == b.partition("_")[0] else 0.0 for b in NAMES] for a in NAMES])
    np.fill_diagonal(same, 1.0)
    return np.asarray(same * np.outer(error, error))


def _flight(
    generator: Generator, flight: str, aircraft: str, tail: str, value: Array, shift: Array, sizes: Array, truth: Truth,
    day: float, events: bool,
) -> FlightResult:  # fmt: skip
    S = statistical_covariance(generator, sizes)
    systematic = SYSTEMATIC * sizes
    flown = value + FLIGHT_SCATTER * sizes * generator.standard_normal(sizes.size)
    estimate = flown + systematic * shift + generator.multivariate_normal(np.zeros(sizes.size), S)
    gap = _diagnosis(generator, tail, truth, day) if events else None
    return FlightResult(
        flight, aircraft, tail, "", _date(day), 60.0, NAMES, estimate, S + np.diag(systematic**2), S,
        np.ones(sizes.size, dtype=bool), gap, None,
    )  # fmt: skip


def _date(day: float) -> datetime.datetime:
    return START + datetime.timedelta(days=day)


def _diagnosis(generator: Generator, tail: str, truth: Truth, day: float) -> dict[str, Any]:
    """The content of a flight's gap.json: what a diagnosis with the stated detection rates says."""
    there = {LACKING: ("time_constant", MOTOR)}
    if tail == truth.slow:
        there[SLOW] = ("elevator", LAG)
    if tail == truth.vane and day >= truth.since:
        there[VANE_CAUSE] = ("alpha", VANE)
    causes = [c for label, (key, size) in there.items() for c in _found(generator, label, key, size)]
    if generator.random() < 0.04:
        causes.append(_cause(str(generator.choice(FALSE)), "size", 0.1, 0.03, float(generator.uniform(0.5, 0.95)), []))
    listed = [{"effect": c["label"], "probability": c["probability"], "share": 0.5} for c in causes]
    listed += [{"effect": other, "probability": 0.05, "share": 0.05} for c in causes for other in c["alternatives"]]
    return {"verdict": "explained" if causes else "no_gap", "causes": causes, "doubted": [], "candidates": listed}


def _found(generator: Generator, label: str, key: str, size: float) -> list[dict[str, Any]]:
    if generator.random() > 0.85:
        return []
    probability = 1.0 - 10.0 ** -generator.uniform(0.5, 3.0)
    error = 0.1 * size
    value = size * (1.0 + 0.05 * generator.standard_normal()) + error * generator.standard_normal()
    other = CONFUSED.get(label)
    if other and generator.random() < 0.15:
        return [_cause(other, key, value, error, probability, [label])]
    return [_cause(label, key, value, error, probability, [other] if other else [])]


def _cause(label: str, key: str, value: float, error: float, probability: float, others: list[str]) -> dict[str, Any]:
    return {
        "effect": label.partition(" of ")[0], "label": label, "parameters": {key: [float(value), float(error)]},
        "probability": float(probability), "indistinguishable_from": [o.partition(" of ")[0] for o in others],
        "alternatives": others,
    }  # fmt: skip
