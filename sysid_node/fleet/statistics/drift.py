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
class DriftCourse:
    """When a derivative changes: ``kind`` is ``step``, ``trend`` or ``configuration``. Dates are days since 1970.

    ``values`` (n,) is what the change is multiplied by in each flight. ``first`` and ``last`` are for a step the dates
    between which it lies with 95 % confidence, else those of the first and the last flight. ``since`` is the date of
    the first flight after the step.
    """

    kind: str
    values: Array
    first: float
    last: float
    since: float
    configuration: str


@dataclass(frozen=True)
class Drift:
    """What one tail's derivative does over time, significant or not.

    ``change`` is the step, the trend's change from the first flight to the last, or the difference of the
    configuration, with its standard error ``error``, in the derivative's unit; ``before`` is the level that it refers
    to.
    """

    aircraft: str
    tail: str
    name: str
    flights: tuple[str, ...]
    course: DriftCourse
    change: float
    error: float
    before: float
    p_value: float
    adjusted_p: float = 1.0
    significant: bool = False


def find_drift(series: DerivativeSeries, omega: float, freedom: int, maintenance: Sequence[float] = ()) -> Drift | None:
    """The most significant drift in the ``series`` of one tail, or None where it has fewer than five flights.

    ``omega`` is the scatter of flights of one tail beyond their statistical errors, as other tails show it, and
    ``freedom`` (at least 1) its degrees of freedom. ``maintenance`` are days since 1970 at which something was done to
    the tail: a step at such a date needs no search. A systematic error is one unknown in all flights of the tail; where
    it enters flights differently, it adds correlated differences.
    """
    if series.count < LEAST_FLIGHTS:
        return None
    courses = _courses(series, maintenance)
    variance, tests = _tested(series, courses, series.statistical**2 + omega**2, freedom)
    best = tests.best
    chosen = courses[best]
    change = float(tests.amplitude[best])
    before = float(np.average(series.value - change * chosen.values, weights=1.0 / variance))
    first, last = _dates(series, courses, tests)
    since = float(series.day[chosen.place]) if chosen.kind == "step" else float(series.day[0])
    course = DriftCourse(chosen.kind, chosen.values, first, last, since, chosen.configuration)
    of_tail = series.aircraft, series.tails[0], series.name, series.flight
    return Drift(*of_tail, course, change, float(tests.error[best]), before, tests.p_value)


def _tested(
    series: DerivativeSeries, courses: Sequence[_Course], variance: Array, freedom: int
) -> tuple[Array, ContrastTests]:
    """The tests, and the variances (n,) of the flights that they were made with.

    A tail whose flights scatter significantly more about the best course than the variances say (chi-square, 5 %) is
    tested by its own scatter.
    """
    systematic = np.outer(series.systematic, series.systematic)
    values, questions = np.array([c.values for c in courses]), [c.question for c in courses]
    tests = compare_contrasts(series.value, np.diag(variance) + systematic, values, questions, freedom)
    left = series.count - 2
    inverse = np.linalg.inv(np.diag(variance) + systematic)
    residual = series.value - tests.amplitude[tests.best] * values[tests.best]
    residual -= inverse.sum(axis=0) @ residual / inverse.sum()
    excess = float(residual @ inverse @ residual) / left
    if excess * left <= stats.chi2.ppf(0.95, left):
        return variance, tests
    own = excess * variance
    return own, compare_contrasts(series.value, np.diag(own) + systematic, values, questions, min(freedom, left))


@dataclass(frozen=True)
class _Course:
    kind: str
    values: Array  # (n,)
    question: str  # that is asked by the course, alone or with others
    place: int = 0  # of the first flight after a step
    configuration: str = ""


def _courses(series: DerivativeSeries, maintenance: Sequence[float]) -> list[_Course]:
    """A step before each flight that leaves two on either side, a straight line, and each other configuration."""
    n, day = series.count, series.day
    known = set(np.searchsorted(day, np.asarray(maintenance, dtype=float)).tolist())
    found = [
        _Course("step", (np.arange(n) >= k).astype(float), "maintenance" if k in known else "step", k)
        for k in range(_SIDE, n - _SIDE + 1)
        if day[k] > day[k - 1]
    ]
    if day[-1] > day[0]:
        found.append(_Course("trend", (day - day[0]) / (day[-1] - day[0]), "trend"))
    return found + _configurations(series.configuration)


def _configurations(names: Sequence[str]) -> list[_Course]:
    """Contrasts of each configuration with all others; none where a tail has one configuration only."""
    words = sorted(set(names), key=lambda name: (-names.count(name), name))
    other = [word for word in words[1:] if names.count(word) >= _SIDE]
    return [
        _Course("configuration", np.array([float(name == word) for name in names]), "configuration", 0, word)
        for word in other
    ]


def _dates(series: DerivativeSeries, courses: Sequence[_Course], tests: ContrastTests) -> tuple[float, float]:
    """Days between which the step lies: those of steps whose likelihood is within 95 % of the best; else all days."""
    best = tests.best
    if courses[best].kind != "step":
        return float(series.day[0]), float(series.day[-1])
    near = tests.statistic**2 > tests.statistic[best] ** 2 - _HALF_NORMAL**2
    places = [c.place for c, keep in zip(courses, near, strict=True) if keep and c.kind == "step"]
    return float(series.day[min(places) - 1]), float(series.day[max(places)])
