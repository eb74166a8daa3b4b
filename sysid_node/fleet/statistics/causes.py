"""Causes of the gap over a fleet: to whom each belongs, and how large it is in the type and in each tail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from sysid_node.fleet.results import FlightResult
from sysid_node.fleet.statistics.cause_evidence import GroupBelief, TailEvidence, pooled
from sysid_node.fleet.statistics.diagnoses import FlightDiagnosis, confused_groups, diagnoses_of
from sysid_node.fleet.statistics.random_effects import RandomEffects, fit_random_effects

#: Probability from which a cause is listed for a type or a tail.
LISTED = 0.5


@dataclass(frozen=True)
class Size:
    """A size with its 95 % interval, in the unit of the effect's parameter; NaN ends where there is no interval."""

    value: float
    lower: float
    upper: float


@dataclass(frozen=True)
class TailCause:
    """A cause in one tail.

    ``probability`` is that of the cause in this tail, shared or not, and ``own`` that of the tail having it alone.
    ``sizes`` are the total sizes by parameter, ``shared_sizes`` the type's part of them and ``own_sizes`` the tail's.
    ``since`` (days since 1970) is the date of the first flight with it where it began later; ``found`` of ``flights``
    diagnosed flights named it.
    """

    tail: str
    probability: float
    own: float
    found: int
    flights: int
    since: float | None
    sizes: dict[str, Size]
    shared_sizes: dict[str, Size]
    own_sizes: dict[str, Size]


@dataclass(frozen=True)
class PooledCause:
    """A cause over all tails of a type: ``shared`` is the probability that all have it, which is the simulator's error.

    ``confused_with`` are causes that the diagnoses could not tell from it, with the probability that the type shares
    them instead.
    """

    aircraft: str
    label: str
    shared: float
    sizes: dict[str, Size]
    tails: tuple[TailCause, ...]
    confused_with: dict[str, float]

    @property
    def account(self) -> str:
        """Whose it is: ``simulator``, ``tail``, or ``flight`` where neither has an even chance."""
        if self.shared >= LISTED:
            return "simulator"
        return "tail" if any(t.own >= LISTED for t in self.tails) else "flight"


def pooled_causes(
    flights: Sequence[FlightResult], changes: Mapping[tuple[str, str], Sequence[float]] | None = None
) -> list[PooledCause]:
    """Every cause that some flight gave an even chance, by type, the likeliest to be shared first.

    ``changes`` are by type and tail the days since 1970 of maintenance and of steps of the derivatives, with which a
    tail's own cause is likelier to begin.
    """
    diagnoses = diagnoses_of(sorted(flights, key=lambda f: (f.tail, f.date)))
    found: list[PooledCause] = []
    for aircraft in sorted({d.flight.aircraft for d in diagnoses}):
        of_type = [d for d in diagnoses if d.flight.aircraft == aircraft]
        known = {key[1]: days for key, days in (changes or {}).items() if key[0] == aircraft}
        for group in confused_groups(of_type):
            belief = pooled(group, of_type, known)
            found += [_pooled(aircraft, belief, k, of_type) for k in range(len(group)) if _matters(belief, k, of_type)]
    return sorted(found, key=lambda c: (c.aircraft, -c.shared, c.label))


def _matters(belief: GroupBelief, k: int, diagnoses: Sequence[FlightDiagnosis]) -> bool:
    """Whether a flight names the cause, or the fleet gives it some weight."""
    named = any(d.probabilities.get(belief.labels[k], 0.0) >= LISTED for d in diagnoses)
    return named or belief.shared[k] > 0.05 or bool((belief.own[:, k] > 0.05).any())


def _pooled(aircraft: str, belief: GroupBelief, k: int, diagnoses: Sequence[FlightDiagnosis]) -> PooledCause:
    label, shared = belief.labels[k], float(belief.shared[k])
    chances = [(tail, float(belief.own[j, k])) for j, tail in enumerate(belief.tails)]
    having = [tail.tail for tail, own in chances if shared + own >= LISTED]
    split = _sizes(label, [d for d in diagnoses if d.flight.tail in having], shared >= LISTED)
    tails = tuple(_tail_cause(k, label, tail, own, shared, diagnoses, split) for tail, own in chances)
    others = {name: float(belief.shared[m]) for m, name in enumerate(belief.labels) if m != k}
    of_type = {key: sizes.shared for key, sizes in split.items() if shared >= LISTED}
    return PooledCause(aircraft, label, shared, of_type, tails, others)


def _tail_cause(
    k: int,
    label: str,
    tail: TailEvidence,
    own: float,
    shared: float,
    diagnoses: Sequence[FlightDiagnosis],
    split: dict[str, _SplitSizes],
) -> TailCause:
    mine = [d for d in diagnoses if d.flight.tail == tail.tail]
    onset = tail.onset[k] if own >= LISTED else 0
    day = mine[onset].flight.date.timestamp() / 86400.0 if onset else None
    found = sum(d.probabilities.get(label, 0.0) >= LISTED for d in mine)
    total, of_tail, of_type = {}, {}, {}
    for key, sizes in split.items():
        if tail.tail in sizes.total:
            total[key], of_type[key] = sizes.total[tail.tail], sizes.shared
        if tail.tail in sizes.own:
            of_tail[key] = sizes.own[tail.tail]
    return TailCause(tail.tail, shared + own, own, found, len(mine), day, total, of_type, of_tail)


@dataclass(frozen=True)
class _SplitSizes:
    """The type's part of a parameter, and by tail the total and the own part."""

    shared: Size
    total: dict[str, Size]
    own: dict[str, Size]


def _sizes(label: str, diagnoses: Sequence[FlightDiagnosis], shared: bool) -> dict[str, _SplitSizes]:
    """Sizes of every parameter from the flights that name the cause, by random effects.

    A cause that the type does not share has no shared part; each tail then has a model of its own.
    """
    rows: dict[str, list[tuple[str, float, float]]] = {}
    for d in diagnoses:
        if d.probabilities.get(label, 0.0) >= LISTED:
            for key, (value, error) in d.sizes.get(label, {}).items():
                rows.setdefault(key, []).append((d.flight.tail, value, error))
    return {key: _shared_split(found) if shared else _own_split(found) for key, found in rows.items()}


def _own_split(rows: Sequence[tuple[str, float, float]]) -> _SplitSizes:
    nothing = Size(0.0, 0.0, 0.0)
    alone = {tail: _mean([row for row in rows if row[0] == tail]) for tail in dict.fromkeys(row[0] for row in rows)}
    return _SplitSizes(nothing, alone, alone)


def _mean(rows: Sequence[tuple[str, float, float]]) -> Size:
    value, error = np.array([row[1:] for row in rows]).T
    fit = fit_random_effects(value, error, np.zeros(value.size), np.zeros(value.size, dtype=np.intp))
    return Size(fit.mean, fit.lower, fit.upper)


def _shared_split(rows: Sequence[tuple[str, float, float]]) -> _SplitSizes:
    tails = tuple(dict.fromkeys(row[0] for row in rows))
    value, error = np.array([row[1:] for row in rows]).T
    tail = np.array([tails.index(row[0]) for row in rows], dtype=np.intp)
    fit = fit_random_effects(value, error, np.zeros(value.size), tail)
    if len(tails) == 1:  # the type's part cannot be told from the tail's
        return _SplitSizes(Size(fit.mean, fit.lower, fit.upper), {tails[0]: Size(fit.mean, fit.lower, fit.upper)}, {})
    t = float(stats.t.ppf(0.975, len(tails) - 1))
    total = {name: _around(fit.by_tail.level[j], t * fit.by_tail.level_error[j]) for j, name in enumerate(tails)}
    own = {name: _own_part(fit, j, t) for j, name in enumerate(tails)}
    return _SplitSizes(Size(fit.mean, fit.lower, fit.upper), total, own)


def _own_part(fit: RandomEffects, j: int, t: float) -> Size:
    """A tail's deviation from the type's size, with an interval that holds those of all likely scatters of tails.

    At a scatter of zero no tail could differ, which few tails cannot show: the interval is therefore the hull of that
    at the estimated scatter and that at the upper end of its 95 % interval.
    """
    deviation, variance = float(fit.by_tail.own[j] - fit.mean), float(fit.by_tail.own_error[j] ** 2)
    ends = []
    for scatter in (fit.tails.value, fit.tails.upper):
        kept = scatter**2 / (scatter**2 + variance)
        half = t * np.sqrt(kept * variance + kept**2 * fit.mean_error**2)
        ends += [kept * deviation - half, kept * deviation + half]
    return Size(float(fit.by_tail.level[j] - fit.mean), float(min(ends)), float(max(ends)))


def _around(value: float, half: float) -> Size:
    return Size(float(value), float(value - half), float(value + half))
