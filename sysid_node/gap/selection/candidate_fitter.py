"""Sets of candidates fitted: a first look at each upon what is known so far, the likeliest to the end."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from sysid_node.gap.estimation.candidate_fit import CandidateFit, with_candidates
from sysid_node.gap.estimation.candidates import PER_CONTROL, Candidate
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import HeldOutFlight, Nuisances
from sysid_node.gap.estimation.predictive_density import Evidence, competing_evidence
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.residuals.parameter_priors import bounds
from sysid_node.gap.selection.onset import search_onset
from sysid_node.gap.thresholds import THRESHOLDS

Progress = Callable[[float, str], None]

#: Deviance that a candidate leaves at a first look, and the values from which its fit starts.
Screened = tuple[float, Candidate, tuple[float, ...]]

_Work = TypeVar("_Work")
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class FittedSet:
    """A set of candidates fitted, and its evidence; ``added`` is what it has more than what it was tried upon."""

    fit: CandidateFit
    evidence: Evidence
    added: Candidate | None = None


@dataclass(frozen=True)
class CandidateFitter:
    """Fits sets of candidates, the nuisances always along."""

    nuisances: Nuisances
    checkpoint: Checkpoint
    held_out: Sequence[HeldOutFlight] = ()
    fitted: dict[frozenset[str], FittedSet] = field(default_factory=dict)  # by the labels of the set
    screened: dict[frozenset[str], dict[str, Screened]] = field(default_factory=dict)  # upon such a set, by label

    def fit_set(self, fit: CandidateFit, candidates: Sequence[Candidate], look: Screened | None = None) -> FittedSet:
        """A set of candidates fitted from where another fit stands; what is added to the set starts at its look."""
        _, added, start = look or (0.0, None, ())
        wanted = [*candidates, *([added] if added else [])]
        labels = frozenset(c.label for c in wanted)
        if labels not in self.fitted:
            done = self.checkpoint.converged(with_candidates(fit, wanted, self.nuisances, start))
            if added is not None and (moved := search_onset(done, added)) is not done:
                done = self.checkpoint.converged(moved)
            self.fitted[labels] = FittedSet(done, competing_evidence(done, self.held_out))
        return replace(self.fitted[labels], added=added)

    def screen(self, current: FittedSet, candidates: Sequence[Candidate], progress: Progress) -> list[Screened]:
        """A first look at each, the best first: what it takes away where the nuisances can do no more."""
        seen = self.screened.setdefault(frozenset(c.label for c in current.fit.candidates), {})
        fresh = [c for c in candidates if c.label not in seen]

        def work() -> dict[str, list[float]]:
            problem = VariableProjection(current.fit)
            looks = _spread(
                lambda candidate: _first_look_or_none(current.fit, problem, candidate),
                fresh,
                lambda s: progress(0.5 * s, "a first look at every effect"),
            )
            return {candidate.label: [cost, *start] for cost, candidate, start in looks}

        if fresh:
            table = self.checkpoint.table(current.fit, [c.label for c in fresh], work)
            seen.update({c.label: (table[c.label][0], c, tuple(table[c.label][1:])) for c in fresh if c.label in table})
        return sorted((seen[c.label] for c in candidates if c.label in seen), key=lambda look: look[0])

    def screen_upon(
        self, frontier: Sequence[FittedSet], candidates: Sequence[Candidate], progress: Progress
    ) -> list[tuple[FittedSet, Screened]]:
        """First looks at each upon each of several explanations, the best first; every set of effects once."""
        found: list[tuple[FittedSet, Screened]] = []
        for i, current in enumerate(frontier):
            rest = [c for c in candidates if c.effect not in current.fit.effects]
            part = lambda share, text, i=i: progress((i + share) / len(frontier), text)  # noqa: E731
            found += [(current, look) for look in self.screen(current, rest, part)]
        best: dict[frozenset[str], tuple[FittedSet, Screened]] = {}
        for current, look in sorted(found, key=lambda pair: pair[1][0]):
            labels = frozenset({look[1].label, *(c.label for c in current.fit.candidates)})
            best.setdefault(labels, (current, look))
        return list(best.values())

    def add(self, current: FittedSet, look: Screened) -> FittedSet | None:
        """A candidate added to an explanation; None where no numbers come of it.

        Where slopes grow without end a set predicts nothing, and is no explanation.
        """
        try:
            with _endless():
                return self.fit_set(current.fit, current.fit.candidates, look)
        except np.linalg.LinAlgError:
            return None

    def add_candidate(self, chosen: FittedSet, rival: Candidate) -> FittedSet | None:
        """A rival added to what was chosen; None where no numbers come of it."""
        (look,) = self.screen(chosen, [rival], lambda s, t: None)
        return self.add(chosen, look)

    def fit_screened(
        self, looks: Sequence[tuple[FittedSet, Screened]], progress: Progress
    ) -> list[tuple[FittedSet, FittedSet]]:
        """What was looked at, fitted to the end, after what it was looked at upon; the most probable first."""
        trials = _spread(
            lambda pair: (pair[0], self.add(*pair)),
            looks,
            lambda s: progress(0.5 + 0.5 * s, "the likeliest effects"),
        )
        done = [(current, trial) for current, trial in trials if trial is not None]
        return sorted(done, key=lambda pair: -pair[1].evidence.total)


def best_screened(looks: Sequence[tuple[FittedSet, Screened]], most: int) -> list[tuple[FittedSet, Screened]]:
    """The best looks upon each explanation; one effect in many shapes leaves room for others."""
    seen: Counter[tuple[int, str]] = Counter()
    kept = []
    for current, look in looks:
        effect = look[1].effect
        if seen[id(current), ""] < most and seen[id(current), effect] < THRESHOLDS.search.per_effect:
            seen.update([(id(current), ""), (id(current), effect)])
            kept.append((current, look))
    return kept


def with_found_onsets(candidates: Sequence[Candidate], looks: Sequence[Screened]) -> list[Candidate]:
    """The candidates with one start each where it is the onset that they differ in: looking at all again costs most."""
    best = {candidate.label: start for _, candidate, start in reversed(looks)}
    return [
        replace(c, starts=(best[c.label],)) if c.effect in PER_CONTROL and c.label in best else c for c in candidates
    ]


def _endless() -> np.errstate:
    """Of predictions without end the result tells: NumPy need not warn of them."""
    return np.errstate(over="ignore", invalid="ignore")


def _spread(
    work: Callable[[_Work], _Result], over: Sequence[_Work], progress: Callable[[float], None]
) -> list[_Result]:
    """The work on each, in their order; on one thread more than there are processors, for each waits for XLA."""
    done = []

    def quietly(item: _Work) -> _Result:
        with _endless():
            return work(item)

    with ThreadPoolExecutor((os.cpu_count() or 1) + 1) as pool:
        for result in pool.map(quietly, over):
            done.append(result)
            progress(len(done) / len(over))
    return done


def _first_look_or_none(fit: CandidateFit, problem: VariableProjection, candidate: Candidate) -> Screened:
    """The first look; infinitely much is left where no numbers come of it."""
    try:
        return _first_look(fit, problem, candidate)
    except np.linalg.LinAlgError:
        return np.inf, candidate, candidate.starts[0]


def _first_look(fit: CandidateFit, problem: VariableProjection, candidate: Candidate) -> Screened:
    """What is left after one Gauss-Newton step from the best start, of the candidate and of all that is known so far.

    What is known so far must be let move along: alone it has bent to hold the other's share, and would hide it.
    """
    if not candidate.indices:
        widened = with_candidates(fit, [*fit.candidates, candidate], fit.nuisances, ())
        problem = VariableProjection(widened)
        return problem.deviance(problem.residual(widened.values)), candidate, ()
    low, high = bounds(fit.simulator, (*fit.indices, *candidate.indices))
    best: Screened = (np.inf, candidate, candidate.starts[0])
    look = problem.with_candidate(candidate)
    for start in candidate.starts:
        values = np.concatenate([fit.values, start])
        rows = look.residual_and_slopes(values)
        step = np.linalg.lstsq(look.jacobian(values), -rows, rcond=None)[0]
        stepped = np.clip(values + step, low, high)
        for there, left in ((values, rows), (stepped, look.residual(stepped))):
            deviance = look.deviance(left)
            if deviance < best[0]:
                best = (deviance, candidate, tuple(there[fit.values.size :].tolist()))
    return best
