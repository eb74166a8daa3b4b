"""The next step of the stepwise replacement, as a pure function of a table of scores.

An explanation changes by one cause at a time: a cause that is no longer needed, given the others, is dropped; else an
alternative takes a cause's place where both kinds of evidence together clearly prefer it. ``selection.alternatives``
measures the table, and fits what the step asks for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, inf
from typing import Protocol

from sysid_node.gap.selection.acceptance import ComparisonScores, is_accepted
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds


class AlternativeScores(Protocol):
    """One alternative to a cause, in the cause's place."""

    @property
    def label(self) -> str:
        """The alternative's label."""

    @property
    def comparison(self) -> ComparisonScores:
        """The explanation with the alternative, against the one without the cause."""

    @property
    def lead(self) -> float:
        """Difference of log predictive scores plus log Bayes factor against the present explanation, nats."""

    @property
    def fewer(self) -> int:
        """Parameters that it has fewer than the cause, where both are variants of one effect; else 0."""

    @property
    def alike(self) -> bool:
        """Whether the sizes of the variant with more parameters are the same within what sizes are known to."""


class PositionScores(Protocol):
    """One cause of the present explanation."""

    @property
    def comparison(self) -> ComparisonScores:
        """The present explanation, against the one without the cause."""

    @property
    def score_without(self) -> float:
        """Log predictive score of the explanation without the cause, nats."""

    @property
    def alternatives(self) -> Sequence[AlternativeScores]:
        """What was fitted in the cause's place."""


@dataclass(frozen=True)
class AlternativeTable:
    """The scores of one alternative as plain values."""

    label: str
    comparison: ComparisonScores
    lead: float
    fewer: int = 0
    alike: bool = False


@dataclass(frozen=True)
class PositionTable:
    """The scores of one cause's position as plain values."""

    comparison: ComparisonScores
    score_without: float
    alternatives: tuple[AlternativeTable, ...] = ()


@dataclass(frozen=True)
class Step:
    """The next explanation: that without the cause at ``position``, or with one of its alternatives in its place."""

    position: int
    alternative: int | None = None


def next_step(
    positions: Sequence[PositionScores],
    barred: frozenset[str] = frozenset(),
    thresholds: Thresholds = THRESHOLDS,
) -> Step | None:
    """The step to a better explanation; none where the present one is kept.

    Of several causes that are not needed, that one is dropped without which flight not fitted is best predicted; a
    single cause is not dropped here. Alternatives whose label is ``barred`` are left out. Of the variants of one effect
    (all controls alike, one, each by itself) the one with fewer parameters takes the place unless the other leads by
    the penalty of its parameters, and in any case where the sizes of the other are alike: predictions are so precise
    that a difference of a hundredth, which is the simulator's own error, would decide otherwise.
    """

    def lead(alternative: AlternativeScores) -> float:
        if alternative.fewer and alternative.alike:
            return copysign(inf, alternative.fewer)
        return alternative.lead + 0.5 * thresholds.search.penalty * alternative.fewer

    needless = [
        i for i, each in enumerate(positions) if len(positions) > 1 and not is_accepted(each.comparison, thresholds)
    ]
    if needless:
        return Step(max(needless, key=lambda i: positions[i].score_without))
    accepted = [
        (alternative, Step(i, k))
        for i, position in enumerate(positions)
        for k, alternative in enumerate(position.alternatives)
        if alternative.label not in barred and is_accepted(alternative.comparison, thresholds)
    ]
    best = max(accepted, key=lambda pair: lead(pair[0]), default=None)
    return best[1] if best is not None and lead(best[0]) > thresholds.search.lead else None
