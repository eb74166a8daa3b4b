"""Stepwise replacement: every cause against its alternatives, the other causes given.

The first effect was chosen before the others were known. Another may take its place now, or none may be needed.
``selection.replacement`` decides each step; here its scores are measured and what it asks for is fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sysid_node.gap.estimation.candidates import RESPONSE_DELAYS, SHARED, TIME_EFFECTS, Candidate
from sysid_node.gap.instruments.bayes_factor import log_bayes_factor_of_alternatives
from sysid_node.gap.selection.acceptance import is_accepted
from sysid_node.gap.selection.calibration import is_flexible
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.selection.comparison import Comparison
from sysid_node.gap.selection.fitted_set import FittedSet, Stage
from sysid_node.gap.selection.replacement import Step, are_alike, are_as_stated, next_step
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim.model.parameters import stated_parameters


@dataclass(frozen=True)
class CauseAlternatives:
    """A cause of an explanation, the explanation without it, and all that was fitted in its place."""

    candidate: Candidate
    without: FittedSet
    alternatives: tuple[FittedSet, ...]


def replace_stepwise(
    fitter: CandidateFitter,
    base: FittedSet,
    chosen: FittedSet,
    stages: Sequence[Stage],
    always: Sequence[Candidate],
    barred: frozenset[str] = frozenset(),
) -> tuple[FittedSet, tuple[CauseAlternatives, ...]]:
    """The explanation after every cause was compared with its alternatives, and these.

    Alternatives are the candidates that were likely in some stage of the forward selection, and those that are
    ``always`` tried; some are ``barred`` by label from taking a cause's place.
    """
    likely = {each.label: each for stage in stages for each in stage.likely}
    untried = [candidate for candidate in always if candidate.label not in likely]
    pool = [*likely.values(), *untried]
    for _ in range(THRESHOLDS.search.sweeps):
        positions = _positions(fitter, base, chosen, stages[0].fitted, pool, untried)
        scores = [_Position(fitter, base, chosen, each) for each in positions]
        step = next_step(scores, barred)
        if step is None:
            return chosen, positions
        chosen = _after(scores[step.position], step)
    return chosen, _positions(fitter, base, chosen, stages[0].fitted, pool, untried)


def _after(position: _Position, step: Step) -> FittedSet:
    """The explanation after a step at a position."""
    if step.alternative is None:
        return position.measured.without
    alternative = position.alternatives[step.alternative]
    return alternative.both if step.beside and alternative.both is not None else alternative.fitted


def _positions(
    fitter: CandidateFitter,
    base: FittedSet,
    chosen: FittedSet,
    first: list[FittedSet],
    pool: list[Candidate],
    untried: list[Candidate],
) -> tuple[CauseAlternatives, ...]:
    """Every cause of an explanation with its alternatives, fitted."""
    return tuple(_alternatives(fitter, base, chosen, cause, first, pool, untried) for cause in chosen.fit.candidates)


def _alternatives(
    fitter: CandidateFitter,
    base: FittedSet,
    chosen: FittedSet,
    cause: Candidate,
    first: list[FittedSet],
    pool: list[Candidate],
    untried: list[Candidate],
) -> CauseAlternatives:
    """A cause with the likeliest alternatives; where the cause delays the response, with all that delay it.

    Wrong derivatives can stand in for another effect, and explain more than it does with their many parameters. They
    are compared with every effect that was fitted alone.

    What delays the response of one control is compared with what delays that control's, or all controls'. An effect
    with a size for each control is compared with the same effect of each control alone: one slow servo is no more.
    Alternatives to a single cause were fitted in the first stage of the forward selection.
    """
    others = [candidate for candidate in chosen.fit.candidates if candidate is not cause]
    without = fitter.fit_set(chosen.fit, others) if others else base
    rest = [
        candidate
        for candidate in pool
        if candidate.effect not in without.fit.effects
        and (candidate not in untried or candidate.scope in ("", cause.scope) or candidate.effect == cause.effect)
    ]
    screened = fitter.screen_upon([without], rest, lambda share, text: None)
    likely = screened[: THRESHOLDS.search.alternatives] if others else []
    rest_screened = screened[len(likely) :]
    alone = {each.added.label for each in first if each.added} if is_flexible(cause.effect) else set()
    close = [p for p in rest_screened if _is_close(p.screened.candidate, cause) or p.screened.candidate.label in alone]
    fitted = fitter.fit_screened([*likely, *close], lambda share, text: None)
    by_label = {} if others else {each.added.label: each for each in first if each.added}
    by_label |= {each.added.label: each for _, each in fitted if each.added}
    return CauseAlternatives(cause, without, tuple(by_label.values()))


def _is_close(candidate: Candidate, cause: Candidate) -> bool:
    """Whether a candidate is always fitted in a cause's place."""
    if candidate.effect == cause.effect:
        return cause.effect in SHARED and len(candidate.indices) < len(cause.indices)
    return {candidate.effect, cause.effect} <= RESPONSE_DELAYS and candidate.scope in ("", cause.scope)


@dataclass(frozen=True)
class _Position:
    """Scores of a cause's position, measured when they are read: ``replacement.PositionScores``."""

    fitter: CandidateFitter
    base: FittedSet
    chosen: FittedSet
    measured: CauseAlternatives

    @cached_property
    def comparison(self) -> Comparison:
        return Comparison(self.base, self.measured.without, self.chosen)

    @property
    def score_without(self) -> float:
        return self.measured.without.evidence.total

    @cached_property
    def alternatives(self) -> tuple[_Alternative, ...]:
        return tuple(_Alternative(self, fitted) for fitted in self.measured.alternatives)


@dataclass(frozen=True)
class _Alternative:
    """Scores of one alternative, measured when they are read: ``replacement.AlternativeScores``."""

    position: _Position
    fitted: FittedSet

    @property
    def label(self) -> str:
        return self.fitted.added.label if self.fitted.added else ""

    @cached_property
    def comparison(self) -> Comparison:
        return Comparison(self.position.base, self.position.measured.without, self.fitted)

    @property
    def fewer(self) -> int:
        cause, added = self.position.measured.candidate, self.fitted.added
        if added is None or added.effect != cause.effect or cause.effect not in SHARED:
            return 0
        return len(cause.indices) - len(added.indices)

    @cached_property
    def both(self) -> FittedSet | None:
        """The explanation with the alternative beside the cause; none where the fit gives no numbers."""
        cause, added = self.position.measured.candidate, self.fitted.added
        if added is None or added.effect == cause.effect:
            return None
        return self.position.fitter.add_candidate(self.position.chosen, added)

    @property
    def leaves_cause(self) -> bool:
        if self.both is None:
            return False
        cause_added = replace(self.both, added=self.position.measured.candidate)
        return is_accepted(Comparison(self.position.base, self.fitted, cause_added))

    @property
    def adds_up(self) -> bool:
        both = self.both
        return both is not None and is_accepted(Comparison(self.position.base, self.position.chosen, both))

    @property
    def enough(self) -> bool:
        pair = (self.position.measured.candidate, self.fitted.added)
        more, less = pair if self.fewer > 0 else pair[::-1]
        if not self.fewer or more is None or less is None:
            return False
        return _suffices(self.position.chosen if self.fewer > 0 else self.fitted, more, less)

    @cached_property
    def lead(self) -> float:
        chosen = self.position.chosen
        predictive = self.fitted.evidence.total - chosen.evidence.total
        return predictive + log_bayes_factor_of_alternatives(self.fitted.fit, chosen.fit)


def _suffices(fitted: FittedSet, more: Candidate, less: Candidate) -> bool:
    """Whether sizes fitted with the variant ``more`` of an effect are those that the simpler variant ``less`` can have.

    One size for all controls suffices where all are the same, one control's where those of the others are the file's.
    Sizes do not tell one law from another.
    """
    if more.law != less.law:
        return False
    fit, point = fitted.fit, fitted.fit.flights[0].point
    every = [
        each
        for each in stated_parameters(fit.simulator.layout, more.effect).values()
        if not set(each.entries).isdisjoint(more.indices)
    ]
    if not less.scope:
        return are_alike([each.value(point) for each in every])
    rest = [[*each.entries] for each in every if set(each.entries).isdisjoint(less.indices)]
    sizes, stated = (np.array([at[entries].sum() for entries in rest]) for at in (point, fit.simulator.neutral()))
    chance = dict(zip(fit.indices, np.sqrt(np.diag(fit.covariance)), strict=False))
    errors = np.array([max(chance.get(i, 0.0) for i in entries) for entries in rest])
    period = max(flight.model.flight.step_interval for flight in fit.flights)
    return are_as_stated(sizes, stated, errors, period if more.effect in TIME_EFFECTS else 0.0)
