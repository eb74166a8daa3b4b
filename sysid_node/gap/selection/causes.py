"""The causes that are kept, each with its probability and the alternatives to it.

After the stepwise replacement every cause is weighed: by its share of the probability among its alternatives, and by
its calibrated evidence. ``selection.retention`` decides which cause has to give way and to what; here its scores are
measured, and the explanation is fitted again until all causes are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.predictive_density import probabilities
from sysid_node.gap.instruments.bayes_factor import log_bayes_factor, log_bayes_factor_of_alternatives
from sysid_node.gap.residuals.excited_axes import excited_windows
from sysid_node.gap.selection.acceptance import is_plausible, is_relevant, nats_by_tolerances
from sysid_node.gap.selection.alternatives import CauseAlternatives, replace_stepwise
from sysid_node.gap.selection.calibration import (
    CauseEvidence,
    calibrated_probability,
    evidence_of,
    imitation,
    is_flexible,
    is_supported_but_misspecified,
    prior_odds,
    probability_by_support,
)
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.selection.comparison import Comparison, derivative_shift, power_left
from sysid_node.gap.selection.fitted_set import FittedSet, Stage
from sysid_node.gap.selection.misspecification import misspecification_of
from sysid_node.gap.selection.retention import (
    CauseTable,
    combined_shares,
    next_challenge,
    shares_by_effect,
    successor,
)
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import EFFECTS

#: Effects by which the commands are late against the IMU's clock.
_COMMANDS_CLOCK = frozenset({"command_delay", "actuator_stamp_delay"})


@dataclass(frozen=True)
class Cause:
    """An effect of the explanation, with its evidence and the alternatives to it."""

    candidate: Candidate
    share: float  # of the probability that it has together with its alternatives
    power_removed: Array  # (12,) that it removes on flight not fitted, the other causes given
    alternatives: tuple[tuple[str, float], ...]  # effects that may be there in its place, and their shares
    evidence: CauseEvidence
    fit: CandidateFit  # of the explanation that it was part of when it was weighed
    alternative_sets: tuple[FittedSet, ...]  # what was fitted in its place
    without: FittedSet  # the explanation without it
    replaced: bool = False  # whether a probable alternative took its place
    plausible: bool = True  # whether real parts are off as far as it is in this explanation
    imitation: float = 0.0  # probability that it only imitates an effect that was rejected for its equation

    @property
    def probability(self) -> float:
        """Probability that it is there."""
        return self.share * self.probability_of_any

    @property
    def probability_of_any(self) -> float:
        """Probability that it, or an alternative named with it, is there; zero where its size is not plausible."""
        return calibrated_probability(self.evidence) * (1.0 - self.imitation) if self.plausible else 0.0

    @property
    def table(self) -> CauseTable:
        """The scores that decide whether it is kept."""
        largest = max((share for _, share in self.alternatives), default=0.0)
        by_support = probability_by_support(self.evidence) * (1.0 - self.imitation) if self.plausible else 0.0
        return CauseTable(self.candidate.label, self.share, largest, self.probability_of_any, by_support)


def variance_by_alternatives(cause: Cause, causes: Sequence[Cause]) -> Array:
    """Variance (P,) of where the parameters stand, because one of the other ``causes`` may be another effect.

    A size depends on what else is blamed: late commands beside late air data move these by as much as a late IMU does.
    So the explanations with the alternatives to the other causes count by their shares (Hoeting, Madigan, Raftery &
    Volinsky (1999), Statistical Science 14(4), eq. 3, about what is stated).
    """
    variance = np.zeros_like(cause.fit.flights[0].point)
    for other in causes:
        for effect, share in other.alternatives if other is not cause else ():
            fitted = [each for each in other.alternative_sets if each.added and each.added.effect == effect]
            if fitted:
                likeliest = max(fitted, key=lambda each: each.evidence.total)
                moved = likeliest.fit.flights[0].point - other.fit.flights[0].point
                variance += share * moved**2
    return variance


#: An explanation, its causes, and the rejected ones.
Selection = tuple[FittedSet, tuple[Cause, ...], tuple[Cause, ...]]


def select_causes(
    fitter: CandidateFitter,
    base: FittedSet,
    chosen: FittedSet,
    stages: Sequence[Stage],
    always: Sequence[Candidate],
    rejected_before: Sequence[Cause] = (),
) -> Selection:
    """The explanation whose causes are all kept, these causes, the most probable first, and the rejected ones.

    ``chosen`` is the explanation of the forward selection with its ``stages``; candidates that are ``always`` tried
    are alternatives to any cause. ``base`` has nuisances only. What was ``rejected_before`` does not come back.

    A flexible effect imitates others. Where one of these was rejected because its equation is wrong, the flexible
    effect is only as probable as its log Bayes factor makes it against that one.
    """
    rejected = list(rejected_before)
    challenged: frozenset[str] = frozenset()
    while True:
        excluded = frozenset(cause.candidate.label for cause in rejected)
        chosen, positions = replace_stepwise(fitter, base, chosen, stages, always, excluded | challenged)
        causes = [_weighed(fitter, base, chosen, position, rejected) for position in positions]
        challenge = next_challenge([cause.table for cause in causes], challenged)
        if challenge is None:
            causes = [_with_late_imu(cause, chosen) for cause in causes]
            return chosen, tuple(sorted(causes, key=lambda cause: -cause.probability)), tuple(rejected)
        cause, position = causes[challenge.index], positions[challenge.index]
        challenged |= {cause.candidate.label}
        new = _successor(base, position, cause, excluded | challenged)
        if challenge.improbable:
            rejected.append(replace(cause, replaced=new is not None))
        chosen = new or (position.without if challenge.improbable else chosen)


def _with_late_imu(cause: Cause, chosen: FittedSet) -> Cause:
    """The cause beside a late IMU where no vane was flown: then a late IMU and late commands cannot be told apart."""
    inferred = any(model.flight.inferred for model in chosen.fit.models)
    if not inferred or cause.candidate.effect not in _COMMANDS_CLOCK:
        return cause
    half = 0.5 * cause.share
    return replace(cause, share=half, alternatives=(("imu_delay", half), *cause.alternatives))


def _successor(base: FittedSet, position: CauseAlternatives, cause: Cause, barred: frozenset[str]) -> FittedSet | None:
    """The explanation with the alternative that takes a challenged cause's place; none where there is none."""
    shares = dict(cause.alternatives)
    wrong = cause.evidence if is_supported_but_misspecified(cause.evidence) else None
    scores = [_Successor(base, position.without, each, shares, wrong) for each in position.alternatives if each.added]
    found = successor(scores, barred)
    return None if found is None else scores[found].fitted


@dataclass(frozen=True)
class _Successor:
    """Scores of a possible successor, measured when they are read: ``retention.SuccessorScores``."""

    base: FittedSet
    without: FittedSet
    fitted: FittedSet
    shares: dict[str, float]
    wrong: CauseEvidence | None  # that of the cause, where its equation is wrong: what may be imitated

    @property
    def added(self) -> Candidate:
        assert self.fitted.added is not None
        return self.fitted.added

    @property
    def label(self) -> str:
        return self.added.label

    @property
    def share(self) -> float:
        return self.shares.get(self.added.effect, 0.0)

    @property
    def score(self) -> float:
        return self.fitted.evidence.total

    @cached_property
    def comparison(self) -> Comparison:
        return Comparison(self.base, self.without, self.fitted)

    @cached_property
    def probability(self) -> float:
        evidence = _evidence(self.fitted, self.without, self.added)
        probability = calibrated_probability(evidence)
        if self.wrong is None or not evidence.flexible:
            return probability
        return probability * (1.0 - imitation(evidence.log_bayes_factor, self.wrong.log_bayes_factor))


def _evidence(fitted: FittedSet, without: FittedSet, candidate: Candidate) -> CauseEvidence:
    """The evidence of a candidate that one fitted set has and another has not."""
    factor = log_bayes_factor(fitted.fit, without.fit)
    windows = excited_windows(fitted.fit.models)
    by_tolerances = nats_by_tolerances((derivative_shift(without.fit), derivative_shift(fitted.fit)))
    tested = misspecification_of(fitted.fit, candidate)
    return evidence_of(candidate.effect, factor, tested, windows, by_tolerances, len(EFFECTS))


def _weighed(
    fitter: CandidateFitter, base: FittedSet, chosen: FittedSet, position: CauseAlternatives, rejected: Sequence[Cause]
) -> Cause:
    """A cause with its share of the probability, summed over all sets of effects that were fitted with it.

    An alternative counts only as far as it does not predict still better beside the cause: effects that add up are no
    alternatives (Hoeting, Madigan, Raftery & Volinsky (1999), Statistical Science 14(4), eq. 1, over sets).
    Alternatives that were ``rejected`` are left out, and so are those that explain nothing that matters.
    """
    candidate, without = position.candidate, position.without
    left_out = {candidate.label, *(each.candidate.label for each in rejected)}
    known = [each for each in position.alternatives if each.added and each.added.label not in left_out]
    in_its_place = zip(known, _shares([chosen], known)[1:], strict=True)
    strong = [each for each, share in in_its_place if share > THRESHOLDS.search.tried_beside]
    idle = [each for each in strong if not is_relevant(Comparison(base, without, each))]
    fitted = [each for each in known if not any(each is other for other in idle)]
    added = [each.added for each in strong if not any(each is other for other in idle) and each.added]
    beside = [fitter.add_candidate(chosen, new) for new in added if new.effect != candidate.effect]
    sets = [chosen, *(each for each in beside if each is not None)]
    effects = [each.added.effect for each in fitted if each.added]
    odds = [*[prior_odds(candidate.effect)] * len(sets), *(prior_odds(effect) for effect in effects), 1.0]
    share, alternatives = shares_by_effect(candidate.effect, effects, _shares(sets, [*fitted, without]), np.array(odds))
    return Cause(
        candidate=candidate,
        share=share,
        power_removed=np.maximum(power_left(without.evidence) - power_left(chosen.evidence), 0.0),
        alternatives=alternatives,
        evidence=_evidence(chosen, without, candidate),
        fit=chosen.fit,
        alternative_sets=position.alternatives,
        without=without,
        plausible=is_plausible(Comparison(base, without, replace(chosen, added=candidate))),
        imitation=_imitation(fitter, chosen, position, rejected),
    )


def _imitation(
    fitter: CandidateFitter, chosen: FittedSet, position: CauseAlternatives, rejected: Sequence[Cause]
) -> float:
    """Probability that a cause only imitates an effect that was rejected for its equation, which a flexible one can.

    It is from what the commands predict, of the cause alone or of both together, whichever they support more.
    """
    if not is_flexible(position.candidate.effect):
        return 0.0
    labels = {each.candidate.label for each in rejected if is_supported_but_misspecified(each.evidence)}
    found, without = [0.0], position.without.fit
    for each in position.alternatives:
        if each.added and each.added.label in labels and each.added.effect != position.candidate.effect:
            both = fitter.add_candidate(chosen, each.added)
            own = max(log_bayes_factor(one.fit, without) for one in (chosen, both) if one)
            found.append(imitation(own, log_bayes_factor(each.fit, without)))
    return max(found)


def _shares(sets: Sequence[FittedSet], others: Sequence[FittedSet]) -> Array:
    """Probabilities (K,) of fitted sets that hold a cause, then of others that do not."""
    predictive = probabilities([each.evidence.scores for each in (*sets, *others)])
    best = sets[int(np.argmax(predictive[: len(sets)]))]
    leads = np.array([_lead(best.fit, each.fit) for each in others])
    return combined_shares(predictive, len(sets), leads)


def _lead(fit: CandidateFit, other: CandidateFit) -> float:
    """Log Bayes factor against another explanation, in pooled noise where this one does not contain the other."""
    labels, others = ({c.label for c in each.candidates} for each in (fit, other))
    return (log_bayes_factor if others < labels else log_bayes_factor_of_alternatives)(fit, other)
