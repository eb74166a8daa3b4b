"""Which causes are kept, as pure functions of tables of scores.

A cause with a probability below 0.5 is replaced by a likelier alternative, or dropped and listed as rejected
(``doubted`` in gap.json). A cause beside which an alternative has the larger share of the probability is challenged
once: the alternative takes its place where it is accepted and probable itself. ``selection.causes`` measures the tables
and fits what the decisions ask for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Protocol

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.selection.acceptance import ComparisonScores, is_accepted
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds


@dataclass(frozen=True)
class CauseTable:
    """The scores of one cause of an explanation."""

    label: str
    share: float  # of the probability that it has together with its alternatives
    alternative_share: float  # the largest share of an alternative; zero without any
    probability: float  # calibrated, that the cause or an alternative named with it is there
    by_support: float  # the same, were its equation not tested


@dataclass(frozen=True)
class Challenge:
    """The cause that has to give way next, and whether because it is improbable; else an alternative is likelier."""

    index: int
    improbable: bool


class SuccessorScores(Protocol):
    """One alternative that may take the place of a challenged cause."""

    @property
    def label(self) -> str:
        """Its label."""

    @property
    def share(self) -> float:
        """Share of the probability that its effect has beside the cause; zero where it is not listed."""

    @property
    def score(self) -> float:
        """Log predictive score of the explanation with it, nats."""

    @property
    def comparison(self) -> ComparisonScores:
        """The explanation with it, against the one without the cause."""

    @property
    def probability(self) -> float:
        """Its calibrated probability in the cause's place."""


def next_challenge(
    causes: Sequence[CauseTable], challenged: frozenset[str] = frozenset(), thresholds: Thresholds = THRESHOLDS
) -> Challenge | None:
    """The cause to be challenged next; none where all are kept.

    First the first cause with a likelier alternative, unless it was ``challenged`` before (labels); then, of the causes
    with a probability below the threshold, the one with the least support: a cause that is not there can be what makes
    the equation of another look wrong.
    """
    for index, cause in enumerate(causes):
        if cause.alternative_share > cause.share and cause.label not in challenged:
            return Challenge(index, improbable=False)
    improbable = [i for i, cause in enumerate(causes) if cause.probability < thresholds.calibration.probability]
    if not improbable:
        return None
    return Challenge(min(improbable, key=lambda i: causes[i].by_support), improbable=True)


def successor(
    alternatives: Sequence[SuccessorScores], barred: frozenset[str] = frozenset(), thresholds: Thresholds = THRESHOLDS
) -> int | None:
    """Index of the alternative that takes a challenged cause's place; none where none is accepted and probable.

    Those with the larger share of the probability come first, then those that predict better.
    """
    accepted = [
        i
        for i, each in enumerate(alternatives)
        if each.label not in barred and is_accepted(each.comparison, thresholds)
    ]
    ranked = sorted(accepted, key=lambda i: (-alternatives[i].share, -alternatives[i].score))
    probable = (i for i in ranked if alternatives[i].probability >= thresholds.calibration.probability)
    return next(probable, None)


def combined_shares(predictive: Array, sets: int, leads: Array) -> Array:
    """Probabilities (K,) of sets of effects that hold a cause, then of others that do not, from two kinds of evidence.

    ``predictive`` (K,) are their probabilities by prediction; the first ``sets`` hold the cause. ``leads`` (K - sets,)
    are log Bayes factors, nats, of the best of these against the others. Relative to the likeliest set, each is as
    probable as the kind of evidence says that makes it more probable: what one kind cannot exclude is not excluded.
    """
    best = int(np.argmax(predictive[:sets]))
    by_commands = np.zeros(predictive.size)
    least = min(float(leads.min(initial=0.0)), 0.0)
    by_commands[best], by_commands[sets:] = np.exp(least), np.exp(least - leads)
    shares = np.maximum(predictive / predictive.max(), by_commands)
    return np.asarray(shares / shares.sum())


def shares_by_effect(
    cause: str, alternatives: Sequence[str], shares: Array, odds: Array
) -> tuple[float, tuple[tuple[str, float], ...]]:
    """The cause's share of the probability, and that of each alternative effect, the likeliest first.

    ``shares`` (K,) and prior ``odds`` (K,) are those of the sets that hold the cause, of one set for each alternative
    (their effects), and of doing without, in this order. What is probable without any of them is no alternative.
    """
    posterior = odds * shares
    posterior = posterior / posterior.sum()
    sets = posterior.size - len(alternatives) - 1
    by_effect = {cause: float(posterior[:sets].sum())}
    for effect, share in zip(alternatives, posterior[sets:-1], strict=True):
        by_effect[effect] = by_effect.get(effect, 0.0) + float(share)
    others = sorted(((e, p) for e, p in by_effect.items() if e != cause), key=lambda pair: -pair[1])
    return by_effect[cause], tuple(others)


def kept_causes(probabilities: Sequence[float]) -> list[tuple[int, ...]]:
    """Indices of the causes that are kept where one of at most three is left out, or two; in the order to be tried.

    The order is that of the probability that none of those left out is there, the largest first: a cause that is beyond
    doubt is left out after two that are not. In a tie the larger explanation comes first.
    """
    indices = range(len(probabilities))
    sets = [kept for size in range(len(probabilities) - 1, 0, -1) for kept in combinations(indices, size)]
    absent = [math.prod(1.0 - probabilities[i] for i in indices if i not in kept) for kept in sets]
    return [sets[k] for k in sorted(range(len(sets)), key=lambda k: -absent[k])]
