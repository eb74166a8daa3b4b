"""Evidence of many flights for a cause, added up: is it the type's, one tail's own, or one flight's own?

The model of a group of causes that flights confuse, so that at most one of them is there (K causes):

* With probability ``shared`` (divided by K) a cause is in all tails of the type: the simulator lacks it.
* Else it is one tail's own, with probability ``own`` for each tail, from its first flight on or from a later one. A
  later one is likelier to be the first after maintenance, or after a step of the tail's derivatives.
* Else it is one flight's own (or a false diagnosis), with probability ``single`` for each flight.
* A flight fails to show a cause that is there with probability ``failing``.

A flight's diagnosis gives the likelihood ratio of a cause against none: the odds of its probability over the prior odds
``shared`` of one cause among those that the diagnosis weighs. A flight that does not list the cause has the ratio
``missed``, and 1 where it supports no diagnosis. Ratios are multiplied, not averaged; the chances of failing and of a
single flight bound what one flight can add. Sums over the unknown states are exact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from sysid_node.fleet.statistics.diagnoses import FlightDiagnosis
from sysid_node.fleet.statistics.series import DAY
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class CausePriors:
    """Probabilities before any flight."""

    shared: float = 0.03  # of one cause among the thirty or so that a diagnosis weighs
    own: float = 0.01  # that a tail has a cause of its own
    single: float = 0.01  # of one flight's own cause or a false one: of 49 real records 17 named one of the thirty so
    failing: float = 0.2  # that a flight does not show what is there: of 30 in moderate turbulence five did not
    missed: float = 0.3  # likelihood ratio of a diagnosis that does not list the cause
    from_start: float = 0.5  # that a tail's own cause is there from its first flight on
    at_change: float = 0.5  # that one which begins later begins at a known change of the tail, where there is one


PRIORS = CausePriors()


@dataclass(frozen=True)
class TailEvidence:
    """Evidence of one tail's n flights for each of K causes; ``onset`` is the likeliest first flight (K,) with it.

    ``gain`` (K,) is the log likelihood ratio of the cause in all flights against in none, ``own`` (K,) that of the
    cause as the tail's own from some flight on.
    """

    tail: str
    gain: Array
    own: Array
    onset: tuple[int, ...]


@dataclass(frozen=True)
class GroupBelief:
    """Probabilities of a group of K causes: ``shared`` (K,) by the type, ``own`` (J, K) by each tail alone."""

    labels: tuple[str, ...]
    shared: Array
    own: Array
    tails: tuple[TailEvidence, ...]


def pooled(
    labels: Sequence[str],
    diagnoses: Sequence[FlightDiagnosis],
    changes: Mapping[str, Sequence[float]] | None = None,
    priors: CausePriors = PRIORS,
) -> GroupBelief:
    """Probabilities that the type shares a cause of the group, and that a tail has it alone, given all flights.

    ``diagnoses`` are those of one type, in the order of their dates within a tail. ``changes`` are by tail the days
    since 1970 of maintenance and of steps of the derivatives.
    """
    tails = tuple(
        _tail(tail, labels, [d for d in diagnoses if d.flight.tail == tail], (changes or {}).get(tail, ()), priors)
        for tail in dict.fromkeys(d.flight.tail for d in diagnoses)
    )
    K = len(labels)
    gains, owns = np.array([t.gain for t in tails]), np.array([t.own for t in tails])  # (J, K)
    without = _any_own(owns, priors)  # (J,) log likelihood of each tail where the type shares nothing
    weights = np.append(np.log(priors.shared / K) + gains.sum(axis=0), np.log1p(-priors.shared) + without.sum())
    chances = np.exp(weights - logsumexp(weights))
    own = chances[-1] * np.exp(np.log(priors.own / K) + owns - without[:, None])
    return GroupBelief(tuple(labels), chances[:-1], own, tails)


def _any_own(owns: Array, priors: CausePriors) -> Array:
    """Log likelihood (J,) of each tail with any cause of its own, or none."""
    K = owns.shape[1]
    choices = np.column_stack([np.full(owns.shape[0], np.log1p(-priors.own)), np.log(priors.own / K) + owns])
    return np.asarray(logsumexp(choices, axis=1))


def _tail(
    tail: str,
    labels: Sequence[str],
    diagnoses: Sequence[FlightDiagnosis],
    changes: Sequence[float],
    priors: CausePriors,
) -> TailEvidence:
    ratio = np.array([[_ratio(label, d, priors) for label in labels] for d in diagnoses])  # (n, K)
    present = np.log((1.0 - priors.failing) * ratio + priors.failing)
    chance = priors.single / len(labels)
    absent = np.log1p(chance * (ratio - 1.0).sum(axis=1))
    gain = present - absent[:, None]
    from_each = np.cumsum(gain[::-1], axis=0)[::-1]  # (n, K): with the cause from this flight on
    day = np.array([d.flight.date.timestamp() / DAY for d in diagnoses])
    weighed = from_each + np.log(_beginnings(day, changes, priors))[:, None]
    return TailEvidence(tail, gain.sum(axis=0), logsumexp(weighed, axis=0), tuple(map(int, weighed.argmax(axis=0))))


def _beginnings(day: Array, changes: Sequence[float], priors: CausePriors) -> Array:
    """Probability (n,) that a tail's own cause begins with the flight of a ``day`` (n,), given that it has one."""
    n = day.size
    if n == 1:
        return np.ones(1)
    later = np.full(n - 1, 1.0 / (n - 1))
    first = np.searchsorted(day, np.asarray(changes, dtype=float))
    known = np.unique(first[(first > 0) & (first < n)])
    if known.size:
        later *= 1.0 - priors.at_change
        later[known - 1] += priors.at_change / known.size
    return np.concatenate([[priors.from_start], (1.0 - priors.from_start) * later])


def _ratio(label: str, diagnosis: FlightDiagnosis, priors: CausePriors) -> float:
    """Likelihood ratio of a cause by one flight."""
    if not diagnosis.informative:
        return 1.0
    probability = diagnosis.probabilities.get(label)
    if probability is None:
        return priors.missed
    return probability / (1.0 - probability) * (1.0 - priors.shared) / priors.shared
