"""Which effects: candidates tried one upon another, accepted by how well they predict flight not fitted.

Forward selection up to three effects, each of which must predict better beyond doubt and close a share of the gap that
matters; then a backward check. Significant is not enough: a clock's odd millisecond is real, and trifling.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.candidates import TIMES, Candidate, bounds, candidates_of
from sysid_node.gap.evidence import Evidence, cross_validated, probabilities
from sysid_node.gap.fit import Fit, Projected, blank, polish, with_candidates
from sysid_node.gap.nuisance import Nuisances
from sysid_node.gap.spectra import power_of
from sysid_node.gap.structure import Structure, instrumented, structure_of
from sysid_node.gap.view import View

#: Effects at once, at most.
MOST = 3

#: Candidates that are fitted to the end after a first look at all.
_POLISHED = 6

#: Probability, against doing without, from which an effect is accepted.
_SURE = 0.95

#: Share of the power left over, and of that which derivatives and biases leave, that an effect must take away on flight
#: not fitted, on the axis where it does most.
MATERIAL, MATERIAL_OF_ALL = 0.25, 0.08

#: Error, as a share of the motion, that nobody would look for.
NOTICED = 0.01

Progress = Callable[[float, str], None]

#: Cost of a candidate at a first look, and the values from which its fit starts.
Look = tuple[float, Candidate, tuple[float, ...]]

_Work = TypeVar("_Work")
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class Trial:
    """A set of candidates fitted, and its evidence; ``added`` is what it has more than what it was tried upon."""

    fit: Fit
    evidence: Evidence
    added: Candidate | None = None


@dataclass(frozen=True)
class Cause:
    """An effect that is blamed, beside the alternatives to it."""

    candidate: Candidate
    probability: float
    alternatives: tuple[tuple[str, float], ...]  # effects that would do nearly as well, and their probabilities


@dataclass(frozen=True)
class Attribution:
    """The explanation, what it was built on, and what is left."""

    base: Trial  # nuisances only
    chosen: Trial
    corrected: Fit  # chosen, its unknowns as gusts do not bias them
    before: Structure  # of what the nuisances leave
    left: Structure  # of what the chosen effects leave
    causes: tuple[Cause, ...]
    table: tuple[tuple[str, float], ...]  # effects tried first, and their probabilities, best first
    trials: tuple[Trial, ...] = field(default=())  # of the first stage


def attribute(views: Sequence[View], nuisances: Nuisances, progress: Progress) -> Attribution:
    """Fits everything that has to be, and chooses."""
    simulator = views[0].simulator
    candidates = candidates_of(simulator, views)
    progress(0.0, "derivatives within their tolerances")
    base = _trial(polish(with_candidates(blank(views, nuisances), [], nuisances, [])), None)
    chosen, stages = base, []
    for count in range(MOST):
        rest = [c for c in candidates if c.effect not in chosen.fit.effects]
        trials = stage(chosen, rest, nuisances, _share_of(progress, count))
        stages.append(trials)
        better = [t for t in trials if accepted(base, chosen, t)]
        if not better:
            break
        chosen = better[0]
    progress(0.8, "what is left over")
    chosen = _backward(base, chosen, nuisances)
    before, left = structure_of(base.fit, chosen.fit), structure_of(chosen.fit)
    causes = _causes(base, chosen, stages, candidates, nuisances, progress)
    corrected = instrumented(instrumented(chosen.fit))
    return Attribution(base, chosen, corrected, before, left, causes, _ranked(base, stages[0]), tuple(stages[0]))


def _share_of(progress: Progress, count: int) -> Progress:
    """Progress of one of the stages as that of all."""
    return lambda share, text: progress((count + share) / (MOST + 1.0), text)


def stage(current: Trial, candidates: Sequence[Candidate], nuisances: Nuisances, progress: Progress) -> list[Trial]:
    """The candidates upon what is known so far, the most probable first."""
    fresh = with_candidates(current.fit, current.fit.candidates, nuisances, ())
    problem = Projected(fresh, bounded=False)

    def look(candidate: Candidate) -> Look:
        return _first_look(fresh, problem, candidate)

    def finish(look: Look) -> Trial:
        _, candidate, start = look
        fit = with_candidates(current.fit, [*current.fit.candidates, candidate], nuisances, start)
        return _trial(polish(fit), candidate)

    looked = _spread(look, candidates, lambda s: progress(0.5 * s, "a first look at every effect"))
    looked.sort(key=lambda look: look[0])
    trials = _spread(finish, looked[:_POLISHED], lambda s: progress(0.5 + 0.5 * s, "the likeliest effects"))
    return sorted(trials, key=lambda t: -t.evidence.total)


def _spread(
    work: Callable[[_Work], _Result], over: Sequence[_Work], progress: Callable[[float], None]
) -> list[_Result]:
    """The work on each, in their order; on as many threads as there are processors, which XLA and LAPACK leave free."""
    done = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for result in pool.map(work, over):
            done.append(result)
            progress(len(done) / len(over))
    return done


def accepted(base: Trial, without: Trial, trial: Trial) -> bool:
    """Whether a trial predicts better than what it was tried upon, beyond doubt, and by enough to matter."""
    sure = probabilities([trial.evidence.scores, without.evidence.scores])[0] > _SURE
    if _trifling(trial):
        return False
    left, whole = power_left(without.evidence), power_left(base.evidence)
    gone = left - power_left(trial.evidence)
    motion = sum((np.abs(v.measured[:, 1:]) ** 2).sum(axis=(0, 1)) for v in trial.evidence.views)
    matters = (gone > MATERIAL * left) & (gone > MATERIAL_OF_ALL * whole) & (gone > NOTICED**2 * motion)
    return bool(sure and np.any(matters))


def _trifling(trial: Trial) -> bool:
    """Whether what was added is a time within one sample of the slowest topic: a matter of sampling."""
    if trial.added is None or trial.added.effect not in TIMES:
        return False
    slowest = min(min(v.flight.actuator_rate, v.flight.air_rate) for v in trial.fit.views)
    return bool(abs(trial.fit.points[0][trial.added.indices[0]]) < 1.0 / slowest)


def power_left(evidence: Evidence) -> Array:
    """Power (12,) of what is left on flight not fitted."""
    return np.asarray(sum(power_of(r) for r in evidence.residuals))


def _trial(fit: Fit, added: Candidate | None) -> Trial:
    return Trial(fit, cross_validated(fit), added)


def _first_look(fit: Fit, problem: Projected, candidate: Candidate) -> Look:
    """The cost that one Gauss-Newton step from the best start leaves, with the weights as they are."""
    if not candidate.indices:
        widened = with_candidates(fit, [*fit.candidates, candidate], fit.nuisances, ())
        return polish(widened, rounds=1, reweigh=False).cost, candidate, ()
    low, high = bounds(fit.views[0].simulator, candidate.indices)
    best: Look = (np.inf, candidate, candidate.starts[0])
    for start in candidate.starts:
        look = problem.looking(candidate.indices)
        values = np.array(start)
        rows, slopes = look.residual(values), look.jacobian(values)
        step = np.linalg.lstsq(slopes, -rows, rcond=None)[0]
        stepped = np.clip(values + step, low, high)
        for there in (values, stepped):
            cost = float(np.sum(look.residual(there) ** 2))
            if cost < best[0]:
                best = (cost, candidate, tuple(there.tolist()))
    return best


def _backward(base: Trial, chosen: Trial, nuisances: Nuisances) -> Trial:
    """Without those effects that the others have made needless."""
    while len(chosen.fit.candidates) > 1:
        fewer = [_without(base, chosen, c, nuisances) for c in chosen.fit.candidates]
        best = max(fewer, key=lambda trial: trial.evidence.total)
        if accepted(base, best, chosen):
            return chosen
        chosen = best
    return chosen


def _without(base: Trial, chosen: Trial, gone: Candidate, nuisances: Nuisances) -> Trial:
    """The chosen set, one effect less, fitted anew."""
    if len(chosen.fit.candidates) == 1:
        return base
    kept = [c for c in chosen.fit.candidates if c is not gone]
    return _trial(polish(with_candidates(chosen.fit, kept, nuisances, ())), None)


def _causes(
    base: Trial, chosen: Trial, stages: Sequence[list[Trial]], candidates: Sequence[Candidate],
    nuisances: Nuisances, progress: Progress,
) -> tuple[Cause, ...]:  # fmt: skip
    """Each effect of the chosen set against all others in its place."""
    causes = []
    for candidate in chosen.fit.candidates:
        progress(0.85, f"alternatives to {candidate.label}")
        others = [c for c in chosen.fit.candidates if c is not candidate]
        if not others:
            rivals, without = stages[0], base
        elif len(others) + 1 == len(stages) - 1 and stages[len(others)][0].fit is chosen.fit:
            rivals, without = stages[len(others)], _without(base, chosen, candidate, nuisances)
        else:
            without = _without(base, chosen, candidate, nuisances)
            rest = [c for c in candidates if c.effect not in without.fit.effects]
            rivals = stage(without, rest, nuisances, lambda s, t: None)
        causes.append(_cause(candidate, chosen, without, rivals))
    return tuple(sorted(causes, key=lambda cause: -cause.probability))


def _cause(candidate: Candidate, chosen: Trial, without: Trial, rivals: Sequence[Trial]) -> Cause:
    """Its probability, summed over the ways in which its effect could act, and who else could be to blame."""
    own = [chosen, *(t for t in rivals if t.added is not None and t.added.label != candidate.label)]
    shares = probabilities([*(t.evidence.scores for t in own), without.evidence.scores])
    by_effect: dict[str, float] = {}
    labels = [candidate.effect, *(t.added.effect for t in own[1:] if t.added)]
    for effect, share in zip(labels, shares[: len(own)], strict=True):
        by_effect[effect] = by_effect.get(effect, 0.0) + float(share)
    rivals_left = sorted(((e, p) for e, p in by_effect.items() if e != candidate.effect), key=lambda pair: -pair[1])
    return Cause(candidate, by_effect[candidate.effect], tuple(rivals_left))


def _ranked(base: Trial, trials: Sequence[Trial]) -> tuple[tuple[str, float], ...]:
    """Every effect that was fitted to the end as the only one, with its probability; none among them."""
    scores = [*(t.evidence.scores for t in trials), base.evidence.scores]
    shares = probabilities(scores)
    labels = [*(t.added.label for t in trials if t.added), "none"]
    return tuple(sorted(zip(labels, shares.tolist(), strict=True), key=lambda pair: -pair[1]))
