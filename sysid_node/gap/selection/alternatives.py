"""Causes against their rivals, the other causes given: whether another would do as well in a cause's place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid_node.gap.estimation.candidates import RESPONSE_DELAYS, Candidate
from sysid_node.gap.instruments.bayes_factor import log_bayes_factor
from sysid_node.gap.selection.acceptance import accepted
from sysid_node.gap.selection.candidate_fitter import CandidateFitter, FittedSet
from sysid_node.gap.thresholds import THRESHOLDS


@dataclass(frozen=True)
class CauseAlternatives:
    """A cause's place in the explanation: what is left without it, and all that was tried in its stead."""

    candidate: Candidate
    without: FittedSet
    alternatives: tuple[FittedSet, ...]


def replace_stepwise(
    fitter: CandidateFitter,
    base: FittedSet,
    chosen: FittedSet,
    stages: Sequence[list[FittedSet]],
    late: Sequence[Candidate],
    barred: frozenset[str] = frozenset(),
) -> tuple[FittedSet, tuple[CauseAlternatives, ...]]:
    """The explanation after every cause has stood against its rivals, given the others; some are ``barred`` by label.

    The first effect was chosen before the others were known: another may take its place now, or none may be needed.
    """
    tried = [t.added for trials in stages for t in trials if t.added]
    pool = list({candidate.label: candidate for candidate in (*tried, *late)}.values())
    for _ in range(THRESHOLDS.search.sweeps):
        places = tuple(_place(fitter, base, chosen, c, stages[0], pool) for c in chosen.fit.candidates)
        better = _replacement(base, chosen, places, barred)
        if better is None:
            return chosen, places
        chosen = better
    return chosen, tuple(_place(fitter, base, chosen, c, stages[0], pool) for c in chosen.fit.candidates)


def _place(
    fitter: CandidateFitter,
    base: FittedSet,
    chosen: FittedSet,
    candidate: Candidate,
    first: list[FittedSet],
    pool: list[Candidate],
) -> CauseAlternatives:
    """Against the likeliest rivals, and where the response is late against all that could make it so."""
    others = [c for c in chosen.fit.candidates if c is not candidate]
    without = fitter.fit_set(chosen.fit, others) if others else base
    rest = [c for c in pool if c.effect not in without.fit.effects]
    looks = fitter.screen_upon([without], rest, lambda s, t: None)
    likely = looks[: THRESHOLDS.search.alternatives] if others else []
    late = [(t, look) for t, look in looks[len(likely) :] if {look[1].effect, candidate.effect} <= RESPONSE_DELAYS]
    rivals = {t.added.label: t for _, t in fitter.fit_screened([*likely, *late], lambda s, t: None) if t.added}
    known = {} if others else {t.added.label: t for t in first if t.added}
    return CauseAlternatives(candidate, without, tuple({**known, **rivals}.values()))


def _replacement(
    base: FittedSet, chosen: FittedSet, places: Sequence[CauseAlternatives], barred: frozenset[str]
) -> FittedSet | None:
    """A better explanation, by both kinds of evidence: one effect less, or another in its place; None where there is
    none."""
    needless = [p.without for p in places if len(places) > 1 and not accepted(base, p.without, chosen)]
    if needless:
        return max(needless, key=lambda trial: trial.evidence.total)
    new = [(p, t) for p in places for t in p.alternatives if t.added is None or t.added.label not in barred]
    rivals = [t for p, t in new if accepted(base, p.without, t)]
    ahead = {id(t): t.evidence.total - chosen.evidence.total + log_bayes_factor(t.fit, chosen.fit) for t in rivals}
    best = max(rivals, key=lambda trial: ahead[id(trial)], default=None)
    return best if best is not None and ahead[id(best)] > THRESHOLDS.search.lead else None
