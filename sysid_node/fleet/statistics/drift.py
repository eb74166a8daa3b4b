"""Drift of one tail's derivative over its flights: a step at a date, a slow trend, or another configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from sysid_node.fleet.statistics.contrasts import ContrastTests, compare_contrasts
from sysid_node.fleet.statistics.series import DerivativeSeries
from sysid_node.flight.record import Array

LEAST_FLIGHTS = 5
_SIDE = 2  # flights on either side of a step
_HALF_NORMAL = float(stats.norm.ppf(0.975))


@dataclass(frozen=True)
class Drift:
    """What one tail's derivative does over time, significant or not.

    ``kind`` is ``step``, ``trend`` or ``configuration``. ``change`` is the step, the trend's change from the first
    flight to the last, or the difference of the configuration, with its standard error ``error``, in the derivative's
    unit; ``before`` is the level that it refers to. ``first`` and ``last`` are days since 1970: for a step those
    between which it lies with 95 % confidence, else those of the first and the last flight. ``since`` (days) is the
    date of the first flight after the step. ``course`` (n,) is what the change is multiplied by in each flight.
    """

    aircraft: str
    tail: str
    name: str
    kind: str
    change: float
    error: float
    before: float
    p_value: float
    first: float
    last: float
    since: float
    configuration: str
    flights: tuple[str, ...]
    course: Array
    adjusted_p: float = 1.0
    significant: bool = False


def find_drift(series: DerivativeSeries, omega: float, freedom: int) -> Drift | None:
    """The largest drift in the ``series`` of one tail, or None where it has fewer than five flights.

    ``omega`` is the scatter of flights of one tail beyond their statistical errors, ``freedom`` (at least 1) its
    degrees of freedom. A systematic error is one unknown in all flights of the tail; where it enters flights
    differently, it adds correlated differences.
    """
    if series.count < LEAST_FLIGHTS:
        return None
    courses = _courses(series)
    covariance = np.diag(series.statistical**2 + omega**2) + np.outer(series.systematic, series.systematic)
    tests = compare_contrasts(series.value, covariance, np.array([c.values for c in courses]), freedom)
    best = int(np.argmax(np.abs(tests.statistic)))
    chosen = courses[best]
    weight = 1.0 / (series.statistical**2 + omega**2)
    change = float(tests.amplitude[best])
    before = float(np.average(series.value - change * chosen.values, weights=weight))
    first, last = _dates(series, courses, tests, best)
    since = float(series.day[chosen.place]) if chosen.kind == "step" else float(series.day[0])
    return Drift(
        series.aircraft, series.tails[0], series.name, chosen.kind, change, float(tests.error[best]), before,
        tests.p_value, first, last, since, chosen.configuration, series.flight, chosen.values,
    )  # fmt: skip


@dataclass(frozen=True)
class _Course:
    kind: str
    values: Array  # (n,)
    place: int = 0  # of the first flight after a step
    configuration: str = ""


def _courses(series: DerivativeSeries) -> list[_Course]:
    """A step before each flight that leaves two on either side, a straight line, and each other configuration."""
    n, day = series.count, series.day
    steps = [_Course("step", (np.arange(n) >= k).astype(float), k) for k in range(_SIDE, n - _SIDE + 1)]
    found = [step for step in steps if day[step.place] > day[step.place - 1]]
    if day[-1] > day[0]:
        found.append(_Course("trend", (day - day[0]) / (day[-1] - day[0])))
    return found + _configurations(series.configuration)


def _configurations(names: Sequence[str]) -> list[_Course]:
    """Contrasts of each configuration with all others; none where a tail has one configuration only."""
    words = sorted(set(names), key=lambda name: (-names.count(name), name))
    other = [word for word in words[1:] if names.count(word) >= _SIDE]
    return [_Course("configuration", np.array([float(name == word) for name in names]), 0, word) for word in other]


def _dates(
    series: DerivativeSeries, courses: Sequence[_Course], tests: ContrastTests, best: int
) -> tuple[float, float]:
    """Days between which the step lies: those of steps whose likelihood is within 95 % of the best; else all days."""
    if courses[best].kind != "step":
        return float(series.day[0]), float(series.day[-1])
    near = tests.statistic**2 > tests.statistic[best] ** 2 - _HALF_NORMAL**2
    places = [c.place for c, keep in zip(courses, near, strict=True) if keep and c.kind == "step"]
    return float(series.day[min(places) - 1]), float(series.day[max(places)])
