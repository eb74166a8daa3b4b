"""Which causes are believed, and how probable each is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.predictive_density import probabilities
from sysid_node.gap.instruments.bayes_factor import log_bayes_factor
from sysid_node.gap.selection.acceptance import accepted, power_left
from sysid_node.gap.selection.alternatives import CauseAlternatives, replace_stepwise
from sysid_node.gap.selection.calibration import CauseEvidence, prior_odds
from sysid_node.gap.selection.candidate_fitter import CandidateFitter, FittedSet
from sysid_node.gap.selection.misspecification import misspecification_of
from sysid_node.gap.thresholds import THRESHOLDS

#: Effects by which commands are on another clock than the IMU.
_COMMANDS_CLOCK = frozenset({"command_delay", "actuator_stamp_delay"})


@dataclass(frozen=True)
class Cause:
    """An effect that is blamed, beside the alternatives to it."""

    candidate: Candidate
    share: float  # of the probability that it has with its rivals
    power_removed: Array  # power (12,) that it takes away on flight not fitted, the other causes given
    alternatives: tuple[tuple[str, float], ...]  # effects that would do nearly as well, and their probabilities
    evidence: CauseEvidence
    fit: CandidateFit  # of the explanation that it was part of when it was weighed
    alternative_sets: tuple[FittedSet, ...]  # what was tried in its stead
    without: FittedSet  # the explanation without it
    replaced: bool = False  # for a rival that can be believed

    @property
    def probability(self) -> float:
        """That it is there."""
        return self.share * self.evidence.probability_by_evidence

    @property
    def likelier(self) -> bool:
        """Whether a rival is likelier."""
        return any(share > self.share for _, share in self.alternatives)


def select_causes(
    fitter: CandidateFitter,
    base: FittedSet,
    chosen: FittedSet,
    stages: Sequence[list[FittedSet]],
    late: Sequence[Candidate],
) -> tuple[FittedSet, tuple[Cause, ...], tuple[Cause, ...]]:
    """The explanation without what is less likely to be there than not, and such causes, one after another.

    A rival that can be believed takes the place of each, where there is one, and one that is likelier that of any.
    """
    doubted: list[Cause] = []
    yielded: frozenset[str] = frozenset()  # labels of what made way
    while True:
        barred = frozenset(cause.candidate.label for cause in doubted)
        chosen, places = replace_stepwise(fitter, base, chosen, stages, late, barred | yielded)
        causes = [_cause(fitter, chosen, place, barred) for place in places]
        second = [cause for cause in causes if cause.likelier and cause.candidate.label not in yielded]
        worst = min(causes, key=lambda cause: cause.evidence.probability_by_evidence, default=None)
        unlikely = worst is not None and worst.evidence.probability_by_evidence < THRESHOLDS.calibration.probability
        out = second[0] if second else worst if unlikely else None
        if out is None:
            causes = [_beside_its_twin(cause, chosen) for cause in causes]
            return chosen, tuple(sorted(causes, key=lambda cause: -cause.probability)), tuple(doubted)
        place = places[causes.index(out)]
        yielded |= {out.candidate.label}
        rival = _instead(base, place, out, barred | yielded)
        if not second:
            doubted.append(replace(out, replaced=rival is not None))
        chosen = rival or (chosen if second else place.without)


def _beside_its_twin(cause: Cause, chosen: FittedSet) -> Cause:
    """Without vanes a late IMU does what late commands do: each is as likely."""
    inferred = any(model.flight.inferred for model in chosen.fit.models)
    if not inferred or cause.candidate.effect not in _COMMANDS_CLOCK:
        return cause
    half = 0.5 * cause.share
    return replace(cause, share=half, alternatives=(("imu_delay", half), *cause.alternatives))


def _instead(base: FittedSet, place: CauseAlternatives, cause: Cause, barred: frozenset[str]) -> FittedSet | None:
    """The likeliest rival that can be believed in a cause's place, None where there is none."""
    likely = dict(cause.alternatives)
    rivals = [
        t for t in place.alternatives if t.added and t.added.label not in barred and accepted(base, place.without, t)
    ]
    for trial in sorted(rivals, key=lambda t: (-likely.get(t.added.effect if t.added else "", 0.0), -t.evidence.total)):
        if _grounds(trial, place.without, trial.added).probability_by_evidence >= THRESHOLDS.calibration.probability:
            return trial
    return None


def _grounds(trial: FittedSet, without: FittedSet, candidate: Candidate | None) -> CauseEvidence:
    """What speaks for a candidate that a trial has more than another."""
    assert candidate is not None
    return CauseEvidence.of(
        candidate.effect, log_bayes_factor(trial.fit, without.fit), misspecification_of(trial.fit, candidate)
    )


def _cause(fitter: CandidateFitter, chosen: FittedSet, place: CauseAlternatives, barred: frozenset[str]) -> Cause:
    """Its probability, summed over all sets of effects that were tried with it, and who else could be to blame.

    A rival is to blame instead only as far as it does not predict still better beside the cause: what adds up is no
    alternative (Hoeting, Madigan, Raftery & Volinsky (1999), Statistical Science 14(4), eq. 1, over sets).
    """
    candidate = place.candidate
    others = barred | {candidate.label}
    rivals = [t for t in place.alternatives if t.added is not None and t.added.label not in others]
    instead = _shares([chosen], rivals)[1:]
    strong = [t for t, share in zip(rivals, instead, strict=True) if share > THRESHOLDS.search.tried_beside]
    tried = [fitter.add_candidate(chosen, t.added) for t in strong if t.added and t.added.effect != candidate.effect]
    sets = [chosen, *(trial for trial in tried if trial is not None)]
    odds = [prior_odds(candidate.effect)] * len(sets) + [prior_odds(t.added.effect) for t in rivals if t.added] + [1.0]
    shares = np.array(odds) * _shares(sets, [*rivals, place.without])
    shares = shares / shares.sum()
    by_effect = {candidate.effect: float(shares[: len(sets)].sum())}
    for trial, share in zip(rivals, shares[len(sets) : -1], strict=True):
        effect = trial.added.effect if trial.added else ""
        by_effect[effect] = by_effect.get(effect, 0.0) + float(share)
    rivals_left = sorted(((e, p) for e, p in by_effect.items() if e != candidate.effect), key=lambda pair: -pair[1])
    taken = np.maximum(power_left(place.without.evidence) - power_left(chosen.evidence), 0.0)
    grounds = _grounds(chosen, place.without, candidate)
    return Cause(
        candidate,
        by_effect[candidate.effect],
        taken,
        tuple(rivals_left),
        grounds,
        chosen.fit,
        place.alternatives,
        place.without,
    )


def _shares(sets: Sequence[FittedSet], others: Sequence[FittedSet]) -> Array:
    """Probabilities of sets of effects that hold a cause, then of others that do not.

    Each is as probable, beside the likeliest, as it is by prediction or by what the commands foretell, whichever is
    more: what either cannot exclude is not excluded.
    """
    predicted = probabilities([t.evidence.scores for t in (*sets, *others)])
    best = int(np.argmax(predicted[: len(sets)]))
    ahead = np.array([log_bayes_factor(sets[best].fit, t.fit) for t in others])
    foretold = np.zeros(predicted.size)
    lead = min(float(ahead.min(initial=0.0)), 0.0)
    foretold[best], foretold[len(sets) :] = np.exp(lead), np.exp(lead - ahead)
    shares = np.maximum(predicted / predicted.max(), foretold)
    return np.asarray(shares / shares.sum())
