"""Causes against their rivals, the other causes given: whether another would do as well in a cause's place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid_node.gap.estimation.candidates import RESPONSE_DELAYS, Candidate
from sysid_node.gap.instruments.bayes_factor import log_bayes_factor
from sysid_node.gap.selection.acceptance import accepted
from sysid_node.gap.selection.candidate_fitter import Trial, Trier
from sysid_node.gap.thresholds import THRESHOLDS


@dataclass(frozen=True)
class Place:
    """A cause's place in the explanation: what is left without it, and all that was tried in its stead."""

    candidate: Candidate
    without: Trial
    rivals: tuple[Trial, ...]


def refined(
    trier: Trier,
    base: Trial,
    chosen: Trial,
    stages: Sequence[list[Trial]],
    late: Sequence[Candidate],
    barred: frozenset[str] = frozenset(),
) -> tuple[Trial, tuple[Place, ...]]:
    """The explanation after every cause has stood against its rivals, given the others; some are ``barred`` by label.

    The first effect was chosen before the others were known: another may take its place now, or none may be needed.
    """
    tried = [t.added for trials in stages for t in trials if t.added]
    pool = list({candidate.label: candidate for candidate in (*tried, *late)}.values())
    for _ in range(THRESHOLDS.search.sweeps):
        places = tuple(_place(trier, base, chosen, c, stages[0], pool) for c in chosen.fit.candidates)
        better = _replacement(base, chosen, places, barred)
        if better is None:
            return chosen, places
        chosen = better
    return chosen, tuple(_place(trier, base, chosen, c, stages[0], pool) for c in chosen.fit.candidates)


def _place(
    trier: Trier, base: Trial, chosen: Trial, candidate: Candidate, first: list[Trial], pool: list[Candidate]
) -> Place:
    """Against the likeliest rivals, and where the response is late against all that could make it so."""
    others = [c for c in chosen.fit.candidates if c is not candidate]
    without = trier.trial(chosen.fit, others) if others else base
    rest = [c for c in pool if c.effect not in without.fit.effects]
    looks = trier.looks_upon([without], rest, lambda s, t: None)
    likely = looks[: THRESHOLDS.search.alternatives] if others else []
    late = [(t, look) for t, look in looks[len(likely) :] if {look[1].effect, candidate.effect} <= RESPONSE_DELAYS]
    rivals = {t.added.label: t for _, t in trier.finish([*likely, *late], lambda s, t: None) if t.added}
    known = {} if others else {t.added.label: t for t in first if t.added}
    return Place(candidate, without, tuple({**known, **rivals}.values()))


def _replacement(base: Trial, chosen: Trial, places: Sequence[Place], barred: frozenset[str]) -> Trial | None:
    """A better explanation, by both kinds of evidence: one effect less, or another in its place; None where there is
    none."""
    needless = [p.without for p in places if len(places) > 1 and not accepted(base, p.without, chosen)]
    if needless:
        return max(needless, key=lambda trial: trial.evidence.total)
    new = [(p, t) for p in places for t in p.rivals if t.added is None or t.added.label not in barred]
    rivals = [t for p, t in new if accepted(base, p.without, t)]
    ahead = {id(t): t.evidence.total - chosen.evidence.total + log_bayes_factor(t.fit, chosen.fit) for t in rivals}
    best = max(rivals, key=lambda trial: ahead[id(trial)], default=None)
    return best if best is not None and ahead[id(best)] > THRESHOLDS.search.lead else None
