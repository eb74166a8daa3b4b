"""Sets of candidates, screened and fitted; whatever was computed before is kept."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from sysid_node.gap.estimation.candidate_fit import CandidateFit, with_candidates
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import HeldOutFlight, Nuisances
from sysid_node.gap.estimation.predictive_density import competing_evidence
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.gap.selection.onset import search_onset
from sysid_node.gap.selection.screening import Screened, ScreenedPair, screened_or_infinite

#: Called with the share that is done (0 to 1) and what is being done.
Progress = Callable[[float, str], None]

#: How many times what it removed elsewhere a candidate may remove beside another. In 26 diagnoses of flights none that
#: caught up with the best explanation, by more than a rounding, had removed less than half as much elsewhere.
_TOGETHER = 3.0

_Work = TypeVar("_Work")
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class CandidateFitter:
    """Screens and fits sets of candidates, always with the nuisances. Flights held out must be predicted, too."""

    nuisances: Nuisances
    checkpoint: Checkpoint
    held_out: Sequence[HeldOutFlight] = ()
    fitted: dict[frozenset[str], FittedSet] = field(default_factory=dict)  # by the labels of the set
    screened: dict[frozenset[str], dict[str, Screened]] = field(default_factory=dict)  # by the set's labels, then label

    def fit_set(self, fit: CandidateFit, candidates: Sequence[Candidate], new: Screened | None = None) -> FittedSet:
        """A set of candidates, and a screened ``new`` one, fitted from where another fit stands.

        Raises numpy.linalg.LinAlgError where the fit gives no numbers.
        """
        added = new.candidate if new else None
        wanted = [*candidates, *([added] if added else [])]
        labels = frozenset(candidate.label for candidate in wanted)
        if labels not in self.fitted:
            start = new.start if new else ()
            found = self.checkpoint.converged(with_candidates(fit, wanted, self.nuisances, start))
            if added is not None and (moved := search_onset(found, added)) is not found:
                found = self.checkpoint.converged(moved)
            self.fitted[labels] = FittedSet(found, competing_evidence(found, self.held_out))
        return replace(self.fitted[labels], added=added)

    def screen(self, current: FittedSet, candidates: Sequence[Candidate], progress: Progress) -> list[Screened]:
        """The candidates screened upon an explanation, the best first."""
        known = self.screened.setdefault(frozenset(c.label for c in current.fit.candidates), {})
        new = [candidate for candidate in candidates if candidate.label not in known]

        def work() -> dict[str, list[float]]:
            problem = VariableProjection(current.fit)
            found = in_parallel(
                lambda candidate: screened_or_infinite(current.fit, problem, candidate),
                new,
                lambda share: progress(0.5 * share, "a first look at every effect"),
            )
            return {each.candidate.label: [each.deviance, each.prior_gain, *each.start] for each in found}

        if new:
            table = self.checkpoint.table(current.fit, [candidate.label for candidate in new], work)
            rows = [(candidate, table[candidate.label]) for candidate in new if candidate.label in table]
            known.update(
                {c.label: Screened(left, c, tuple(start), prior_gain) for c, (left, prior_gain, *start) in rows}
            )
        return sorted((known[c.label] for c in candidates if c.label in known), key=lambda each: each.deviance)

    def screen_upon(
        self, explanations: Sequence[FittedSet], candidates: Sequence[Candidate], progress: Progress
    ) -> list[ScreenedPair]:
        """Candidates screened upon each of several explanations, the best first; every set of effects once.

        The best explanation comes first. Upon one that is behind it only candidates are screened that may catch up.
        """
        pairs: list[ScreenedPair] = []
        for i, current in enumerate(explanations):
            behind = current.deviance - explanations[0].deviance
            rest = [
                candidate
                for candidate in candidates
                if candidate.effect not in current.fit.effects and self._may_remove(candidate, behind)
            ]
            part = lambda share, text, i=i: progress((i + share) / len(explanations), text)  # noqa: E731
            pairs += [ScreenedPair(current, each) for each in self.screen(current, rest, part)]
        best: dict[frozenset[str], ScreenedPair] = {}
        for pair in sorted(pairs, key=lambda pair: pair.screened.deviance):
            labels = {pair.screened.candidate.label, *(c.label for c in pair.explanation.fit.candidates)}
            best.setdefault(frozenset(labels), pair)
        return list(best.values())

    def _may_remove(self, candidate: Candidate, deviance: float) -> bool:
        """Whether a candidate may remove so much, by what it removed of any explanation on which it was screened."""
        removed = [
            self.fitted[labels].deviance - table[candidate.label].deviance
            for labels, table in self.screened.items()
            if candidate.label in table and labels in self.fitted
        ]
        return not removed or _TOGETHER * max(removed) >= deviance

    def add(self, current: FittedSet, new: Screened) -> FittedSet | None:
        """An explanation with a screened candidate added; none where the fit gives no numbers.

        Where predictions diverge a set predicts nothing, and explains nothing.
        """
        try:
            with _divergence_ignored():
                return self.fit_set(current.fit, current.fit.candidates, new)
        except np.linalg.LinAlgError:
            return None

    def add_candidate(self, current: FittedSet, candidate: Candidate) -> FittedSet | None:
        """An explanation with a candidate screened and added; none where the fit gives no numbers."""
        (new,) = self.screen(current, [candidate], lambda share, text: None)
        return self.add(current, new)

    def fit_screened(self, pairs: Sequence[ScreenedPair], progress: Progress) -> list[tuple[FittedSet, FittedSet]]:
        """Each explanation beside the larger one with its screened candidate, which is fitted; the best first.

        The best predicts best. Those whose fit gives no numbers are left out.
        """
        fitted = in_parallel(
            lambda pair: (pair.explanation, self.add(*pair)),
            pairs,
            lambda share: progress(0.5 + 0.5 * share, "the likeliest effects"),
        )
        done = [(smaller, larger) for smaller, larger in fitted if larger is not None]
        return sorted(done, key=lambda sets: -sets[1].evidence.total)


def _divergence_ignored() -> np.errstate:
    """NumPy does not warn of predictions that diverge: they are recognised by their result."""
    return np.errstate(over="ignore", invalid="ignore")


def in_parallel(
    work: Callable[[_Work], _Result], items: Sequence[_Work], progress: Callable[[float], None]
) -> list[_Result]:
    """The work on each item, in their order.

    There is one thread more than there are processors, because each waits for compiled programs at times.
    """
    done = []

    def quietly(item: _Work) -> _Result:
        with _divergence_ignored():
            return work(item)

    with ThreadPoolExecutor((os.cpu_count() or 1) + 1) as pool:
        for result in pool.map(quietly, items):
            done.append(result)
            progress(len(done) / len(items))
    return done
