"""Screening: what each candidate would remove, from one Gauss-Newton step, so that only the best are fitted.

The parameters that are already in the explanation move along with the candidate's. Held, they would hide it, because
they have been fitted to a part of its response.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sysid_node.gap.estimation.candidate_fit import CandidateFit, with_candidates
from sysid_node.gap.estimation.candidates import PER_CONTROL, SHARED, Candidate
from sysid_node.gap.estimation.nuisances import DERIVATIVE_ERROR
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.residuals.parameter_priors import bounds
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds

#: Effects that change the shape of what the surfaces do, so that derivatives have other slopes where they start.
_RESHAPES_COMMANDS = frozenset({"actuator_backlash"})


class Screened(NamedTuple):
    """A candidate that was screened: the deviance that it leaves, and the values from which its fit starts."""

    deviance: float
    candidate: Candidate
    start: tuple[float, ...]
    prior_gain: float = 0.0  # nats by which the derivatives are more probable with it, by the file's tolerances


class ScreenedPair(NamedTuple):
    """A candidate that was screened, and the explanation to which it would be added."""

    explanation: FittedSet
    screened: Screened


def screened_or_infinite(fit: CandidateFit, problem: VariableProjection, candidate: Candidate) -> Screened:
    """The candidate screened; its deviance is infinite where the linear algebra gives no numbers."""
    try:
        return screened(fit, problem, candidate)
    except np.linalg.LinAlgError:
        return Screened(np.inf, candidate, candidate.starts[0])


def screened(fit: CandidateFit, problem: VariableProjection, candidate: Candidate) -> Screened:
    """The candidate with the least deviance that it leaves, over its starts and one step from each.

    ``problem`` is the variable projection of ``fit``. Raises numpy.linalg.LinAlgError.
    """
    if not candidate.indices:
        widened = with_candidates(fit, [*fit.candidates, candidate], fit.nuisances, ())
        return Screened(VariableProjection(widened, problem).deviance(widened.values), candidate, ())
    low, high = bounds(fit.simulator, (*fit.indices, *candidate.indices))
    best = Screened(np.inf, candidate, candidate.starts[0])
    extended = problem.with_candidate(candidate)
    for start in candidate.starts:
        values = np.concatenate([fit.values, start])
        there = _linearised_at(fit, candidate, start) if candidate.effect in _RESHAPES_COMMANDS else extended
        residual = there.residual_and_slopes(values)
        step = np.linalg.lstsq(there.jacobian(values), -residual, rcond=None)[0]
        stepped = np.clip(values + step, low, high)
        for tried in (values, stepped):
            deviance = there.deviance(tried)
            if deviance < best.deviance:
                best = Screened(deviance, candidate, tuple(tried[fit.values.size :].tolist()))
    return _with_derivatives_released(fit, problem, best)


def _linearised_at(fit: CandidateFit, candidate: Candidate, start: tuple[float, ...]) -> VariableProjection:
    """The problem with the slopes of the nuisance parameters where the candidate starts."""
    return VariableProjection(with_candidates(fit, [*fit.candidates, candidate], fit.nuisances, start))


def _with_derivatives_released(fit: CandidateFit, problem: VariableProjection, found: Screened) -> Screened:
    """The candidate screened as before, or after a joint step with nuisance parameters that stand at their limits.

    One cause that shifts all derivatives, as another mass does, takes nothing away as long as these stay at the limits
    to which they went in its absence.
    """
    if not np.isfinite(found.deviance):
        return found
    extended, values = problem.with_candidate(found.candidate), np.concatenate([fit.values, found.start])
    if not problem.free.all():
        values = extended.joint_start(values, *bounds(fit.simulator, (*fit.indices, *found.candidate.indices)))
        deviance = extended.deviance(values)
        if deviance < found.deviance:
            found = Screened(deviance, found.candidate, tuple(values[fit.values.size :].tolist()))
    return found._replace(prior_gain=fit.at(extended.points(values)).derivative_score - fit.derivative_score)


def best_screened(pairs: Sequence[ScreenedPair], most: int, thresholds: Thresholds = THRESHOLDS) -> list[ScreenedPair]:
    """Of pairs, the best first, at most so many for each explanation, and a few of each effect.

    An effect may act on several controls or coefficients, each of them a candidate; others must have room, too. A
    second variant of an effect that all controls may share takes no room. The one that makes the derivatives most
    probable takes none, either: what derivatives made up for, each within its tolerance, leaves little to be removed.
    """
    counts: Counter[tuple[int, str]] = Counter()
    seen: set[tuple[int, str]] = set()
    kept, likely = [], _likely_variants(pairs, thresholds)
    most_probable = _most_probable_derivatives(likely, thresholds)
    for pair in likely:
        explanation, candidate = id(pair.explanation), pair.screened.candidate
        law = f"{candidate.effect} {candidate.law}"
        if pair is most_probable.get(explanation):
            kept.append(pair)
        elif counts[explanation, ""] < most and counts[explanation, law] < thresholds.search.per_effect:
            again = candidate.effect in SHARED and (explanation, candidate.effect) in seen
            counts.update([(explanation, law), *([] if again else [(explanation, "")])])
            seen.add((explanation, candidate.effect))
            kept.append(pair)
    return kept


def _most_probable_derivatives(pairs: Sequence[ScreenedPair], thresholds: Thresholds) -> dict[int, ScreenedPair]:
    """By explanation the pair that makes the derivatives most probable; none where that is little."""
    best: dict[int, ScreenedPair] = {}
    for pair in pairs:
        known = best.get(id(pair.explanation))
        least = thresholds.search.prior_gain if known is None else known.screened.prior_gain
        if pair.screened.prior_gain > least:
            best[id(pair.explanation)] = pair
    return best


def _likely_variants(pairs: Sequence[ScreenedPair], thresholds: Thresholds) -> list[ScreenedPair]:
    """The pairs without the less likely variants of effects that all controls may share, and of wrong derivatives.

    Such an effect may act on all controls alike, on one, or on each by itself. Its variants are compared by their
    deviance, with a penalty for every parameter; the best is kept, and the one that acts on all alike, so that another
    is chosen only where it predicts better. Of a coefficient all derivatives may be off, or one of them alone; the
    variant with the least deviance is kept, in which the priors are.
    """

    def penalised(pair: ScreenedPair) -> float:
        return pair.screened.deviance + thresholds.search.penalty * len(pair.screened.candidate.indices)

    best: dict[tuple[int, str], ScreenedPair] = {}
    for pair in sorted(pairs, key=penalised):
        best.setdefault((id(pair.explanation), _varied(pair.screened.candidate)), pair)
    chosen = {id(pair) for pair in best.values()}
    return [pair for pair in pairs if not _is_variant(pair.screened.candidate) or id(pair) in chosen]


def _varied(candidate: Candidate) -> str:
    """What a candidate is a variant of: its effect and law, and of wrong derivatives the coefficient."""
    coefficient = candidate.scope.partition("_")[0] if candidate.effect == DERIVATIVE_ERROR else ""
    return f"{candidate.effect} {candidate.law}{coefficient}"


def _is_variant(candidate: Candidate) -> bool:
    """Whether a candidate is tried only where it is the best of those of its kind."""
    return candidate.effect == DERIVATIVE_ERROR or (candidate.effect in SHARED and bool(candidate.scope))


def with_found_starts(candidates: Sequence[Candidate], found: Sequence[Screened]) -> list[Candidate]:
    """The candidates, those whose starts cost most to screen with the best one alone.

    These have an onset, or change what the surfaces do. ``found`` are the candidates screened, the best first.
    """
    best = {each.candidate.label: each.start for each in reversed(found)}
    costly = _RESHAPES_COMMANDS.union(PER_CONTROL)
    return [replace(c, starts=(best[c.label],)) if c.effect in costly and c.label in best else c for c in candidates]
