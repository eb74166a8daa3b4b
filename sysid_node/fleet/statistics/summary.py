"""What a fleet tells, as values: populations, tails that stand out, drift, causes, and refusals."""

from __future__ import annotations

import datetime
import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, is_dataclass
from typing import Any

import numpy as np

from sysid_node.fleet.statistics.causes import PooledCause
from sysid_node.fleet.statistics.drift import Drift
from sysid_node.fleet.statistics.false_discovery import FALSE_RATE
from sysid_node.fleet.statistics.joint import JointEffects
from sysid_node.fleet.statistics.population import Population
from sysid_node.fleet.statistics.prior import TailPrior
from sysid_node.fleet.statistics.series import DAY

Key = tuple[str, str]  # type and derivative


@dataclass(frozen=True)
class TailDeviation:
    """How far a tail's derivative lies from the mean of the type's other tails, with its standard error."""

    aircraft: str
    tail: str
    name: str
    distance: float
    error: float
    adjusted_p: float
    significant: bool


@dataclass(frozen=True)
class FileDifference:
    """How far the type's mean lies from the aircraft file: the simulator's error, which all tails share.

    ``error`` holds the systematic errors as common to all tails. ``within`` says whether the difference is within
    twice the file's tolerance (1 sigma) and the error; None where the file states no tolerance.
    """

    aircraft: str
    name: str
    file: float
    difference: float
    error: float
    adjusted_p: float
    significant: bool
    within: bool | None


@dataclass(frozen=True)
class FleetSummary:
    """All that the flights of a fleet tell together."""

    flights: int
    tails: Mapping[str, tuple[str, ...]]  # by type
    populations: Mapping[Key, Population]
    joint: tuple[JointEffects, ...]
    deviations: Mapping[tuple[str, str, str], TailDeviation]  # by type, tail and derivative
    drifts: Mapping[tuple[str, str, str], Drift]
    differences: Mapping[Key, FileDifference]
    causes: tuple[PooledCause, ...]
    priors: Mapping[tuple[str, str], Mapping[str, TailPrior]]  # by type and tail, then by derivative
    refusals: Mapping[str, int]  # by reason

    def is_ambiguous(self, tail: str) -> bool:
        """Whether several types have a tail of this name."""
        return sum(tail in tails for tails in self.tails.values()) > 1

    def to_json(self) -> dict[str, Any]:
        """All as lists, numbers and text; NaN is None and dates are ISO 8601."""
        return {
            "flights": self.flights,
            "false_rate": FALSE_RATE,
            "tails": {aircraft: list(tails) for aircraft, tails in self.tails.items()},
            "populations": [_population(p) for p in self.populations.values()],
            "joint": [_plain(joint) for joint in self.joint],
            "deviations": [_plain(d) for d in self.deviations.values()],
            "drifts": [_drift(d) for d in self.drifts.values()],
            "differences_from_file": [_plain(d) for d in self.differences.values()],
            "causes": [_cause(cause) for cause in self.causes],
            "tail_priors": [
                {"aircraft": key[0], "tail": key[1], "derivatives": _plain(priors)}
                for key, priors in self.priors.items()
            ],
            "refusals": dict(self.refusals),
        }


def count_reasons(reasons: list[str]) -> dict[str, int]:
    """How often each reason occurs, the most frequent first."""
    return dict(Counter(reasons).most_common())


def iso_date(day: float) -> str:
    """The date of a day since 1970, UTC: ``2026-05-03``."""
    return datetime.datetime.fromtimestamp(day * DAY, datetime.UTC).date().isoformat()


def _population(population: Population) -> dict[str, Any]:
    fit, series = population.fit, population.series
    return {
        "aircraft": series.aircraft, "name": series.name, "flights": series.count, "mean": fit.mean,
        "standard_error": _number(fit.total_error), "without_systematic": _number(fit.mean_error),
        "lower": _number(fit.lower), "upper": _number(fit.upper),
        "scatter_of_tails": _plain(fit.tails), "scatter_of_flights": _plain(fit.flights),
        "by_tail": [
            {
                "tail": tail, "own": _number(fit.by_tail.own[j]), "own_error": _number(fit.by_tail.own_error[j]),
                "level": _number(fit.by_tail.level[j]), "level_error": _number(fit.by_tail.level_error[j]),
                "shrinkage": _number(fit.by_tail.shrinkage[j]), "systematic": _number(fit.by_tail.systematic[j]),
            }
            for j, tail in enumerate(series.tails)
        ],
        "owed_to_fleet": {flight: _number(w) for flight, w in zip(series.flight, population.fleet_weight, strict=True)},
    }  # fmt: skip


def _drift(drift: Drift) -> dict[str, Any]:
    course = drift.course
    whose = {"aircraft": drift.aircraft, "tail": drift.tail, "name": drift.name, "kind": course.kind}
    kept = ("change", "error", "before", "p_value", "adjusted_p", "significant")
    days = {key: iso_date(getattr(course, key)) for key in ("first", "last", "since")}
    sizes = {key: _plain(getattr(drift, key)) for key in kept}
    return whose | sizes | days | {"configuration": course.configuration}


def _cause(cause: PooledCause) -> dict[str, Any]:
    content = {"account": cause.account, **_plain(cause)}
    for tail in content["tails"]:
        tail["since"] = None if tail["since"] is None else iso_date(tail["since"])
    return content


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    if is_dataclass(value) and not isinstance(value, type):
        return {key: _plain(item) for key, item in asdict(value).items()}
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.bool_):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return _number(value) if isinstance(value, float) else value
