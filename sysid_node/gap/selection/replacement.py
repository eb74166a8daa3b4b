"""The next step of the stepwise replacement, as a pure function of a table of scores.

An explanation changes by one cause at a time: a cause that is no longer needed, given the others, is dropped; else an
alternative takes a cause's place where both kinds of evidence together clearly prefer it. ``selection.alternatives``
measures the table, and fits what the step asks for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import copysign, inf
from typing import Protocol

import numpy as np

from sysid_node.flight.record import Array
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
    def leaves_cause(self) -> bool:
        """Whether the cause is accepted beside the alternative."""

    @property
    def adds_up(self) -> bool:
        """Whether the alternative is accepted beside the cause as well."""

    @property
    def enough(self) -> bool:
        """Whether the variant with fewer parameters can have the other's sizes, within what sizes are known to."""


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
    enough: bool = False
    leaves_cause: bool = False
    adds_up: bool = False


@dataclass(frozen=True)
class PositionTable:
    """The scores of one cause's position as plain values."""

    comparison: ComparisonScores
    score_without: float
    alternatives: tuple[AlternativeTable, ...] = ()


@dataclass(frozen=True)
class Step:
    """The next explanation: that without the cause at ``position``, or with one of its alternatives in its place.

    ``beside``: with the alternative beside the cause.
    """

    position: int
    alternative: int | None = None
    beside: bool = False


def next_step(
    positions: Sequence[PositionScores],
    barred: frozenset[str] = frozenset(),
    thresholds: Thresholds = THRESHOLDS,
) -> Step | None:
    """The step to a better explanation; none where the present one is kept.

    Of several causes that are not needed, that one is dropped without which flight not fitted is best predicted; a
    single cause is not dropped here. Alternatives whose label is ``barred`` are left out. Of the variants of one effect
    (all controls alike, one, each by itself) the one with fewer parameters takes the place unless the other leads by
    the penalty of its parameters, and in any case where it can have the other's sizes within what these are known to:
    predictions are so precise that a difference of a hundredth, which is the simulator's own error, would decide
    otherwise. An alternative beside which the cause is still needed is none: both stand, or, where there is no room for
    one more or the alternative is not needed beside the cause, the cause alone.
    """
    room = len(positions) < len(thresholds.search.stages)

    def lead(alternative: AlternativeScores) -> float:
        if alternative.fewer and alternative.enough:
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
    better = (pair for pair in accepted if lead(pair[0]) > thresholds.search.lead)
    for alternative, step in sorted(better, key=lambda pair: -lead(pair[0])):
        if not alternative.leaves_cause:
            return step
        if room and alternative.adds_up:
            return replace(step, beside=True)
    return None


def are_alike(sizes: Sequence[float], thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether sizes of several controls are the same within 1.96 sigma of the simulator's own errors."""
    mean = float(np.mean(sizes))
    spread = 1.96 * thresholds.validation.discrepancy * abs(mean)
    return len(sizes) > 1 and bool(np.abs(np.asarray(sizes) - mean).max() < spread)


def are_as_stated(
    sizes: Array, stated: Array, errors: Array, period: float = 0.0, thresholds: Thresholds = THRESHOLDS
) -> bool:
    """Whether sizes (K,) of controls are those that the file states (K,), within 1.96 sigma.

    Sigma is the standard error (K,) and the simulator's own errors together; a time's also that of a stamp, which may
    be anywhere in the ``period`` (s) between two messages.
    """
    own = thresholds.validation.discrepancy * sizes
    return bool((np.abs(sizes - stated) < 1.96 * np.sqrt(errors**2 + own**2 + period**2 / 12.0)).all())
