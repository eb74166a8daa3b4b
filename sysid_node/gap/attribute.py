"""Which effects: candidates tried one upon another, accepted by how well they predict flight not fitted.

Forward selection up to three effects, each of which must predict better beyond doubt and close a share of the gap that
matters; then a backward check. Significant is not enough: a clock's odd millisecond is real, and trifling.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.adequacy import adequacy_of
from sysid_node.gap.candidates import BETWEEN, PER_CONTROL, TIMES, Candidate, bounds, candidates_of
from sysid_node.gap.credence import LIKELY, Grounds, prior
from sysid_node.gap.evidence import Evidence, judged, probabilities
from sysid_node.gap.fit import Fit, Projected, blank, linearised, with_candidates
from sysid_node.gap.foretold import advantage
from sysid_node.gap.nuisance import Nuisances, gusty
from sysid_node.gap.onset import sought
from sysid_node.gap.spectra import power_of
from sysid_node.gap.steps import Steps
from sysid_node.gap.structure import Structure, structure_of, unbiased
from sysid_node.gap.view import CHANNELS, COEFFICIENTS, View
from sysid_node.sim import EFFECTS

#: For the first, second and third effect: explanations that it is tried upon (the best single one need not belong to
#: the best pair), and candidates that are fitted to the end upon each after a first look at all.
_STAGES = ((1, 6), (3, 4), (2, 3))

#: Probability, against doing without, from which an effect is accepted.
_SURE = 0.95

#: The same in nats.
_SURELY = float(np.log(_SURE / (1.0 - _SURE)))

#: What an effect must make up for having been picked from so many, in nats.
_MANY = float(np.log(len(EFFECTS)))

#: Share of the power left over that an effect must take away on the axis where it does most, and share of what
#: derivatives and biases leave there that comes back without it: a fifth of the gap's size.
MATERIAL, MATERIAL_OF_ALL = 0.25, 0.04

#: Error, as a share of the motion, that nobody would look for.
NOTICED = 0.05

#: Error, as a share of the motion, whose end matters however much weather is left.
_PLAIN = 0.2

#: Of these, as many of one effect: it may act on several controls or coefficients.
_SHAPES = 2

#: Rivals of a cause that are fitted to the end.
_RIVALS = 4

#: Probability in a cause's stead from which a rival is also tried beside it.
_WORTH_TRYING = 0.01

#: Times that the causes stand against their rivals, at most.
_SWEEPS = 3

#: Nats of both kinds by which another explanation must be better to take the place of one.
_CLEARLY = 1.0

Progress = Callable[[float, str], None]

#: Deviance that a candidate leaves at a first look, and the values from which its fit starts.
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
    share: float  # of the probability that it has with its rivals
    taken: Array  # power (12,) that it takes away on flight not fitted, the other causes given
    alternatives: tuple[tuple[str, float], ...]  # effects that would do nearly as well, and their probabilities
    grounds: Grounds
    rivals: tuple[Trial, ...] = ()  # what was tried in its stead

    @property
    def probability(self) -> float:
        """That it is there."""
        return self.share * self.grounds.credence

    @property
    def likelier(self) -> bool:
        """Whether a rival is likelier."""
        return any(share > self.share for _, share in self.alternatives)


@dataclass(frozen=True)
class Attribution:
    """The explanation, what it was built on, and what is left."""

    base: Trial  # nuisances only
    chosen: Trial
    corrected: Fit  # chosen, its unknowns as gusts do not bias them
    before: Structure  # of what the nuisances leave
    left: Structure  # of what the chosen effects leave
    causes: tuple[Cause, ...]
    doubted: tuple[Cause, ...]  # what predicts better, but is less likely to be there than not
    table: tuple[tuple[str, float], ...]  # effects tried first, and their probabilities, best first
    trials: tuple[Trial, ...] = field(default=())  # of the first stage

    def as_filed(self) -> Attribution:
        """The aircraft file as it is: where even the derivatives that were fitted predict worse."""
        neutral = tuple(view.simulator.neutral() for view in self.base.fit.views)
        return replace(self, corrected=linearised(replace(self.base.fit, points=neutral)))

    def without_causes(self) -> Attribution:
        """Nothing blamed: where the causes predict no better than the derivatives within their tolerances."""
        corrected = unbiased(self.base.fit)
        return replace(self, chosen=self.base, corrected=corrected, left=structure_of(self.base.fit), causes=())


def attribute(
    views: Sequence[View],
    nuisances: Nuisances,
    progress: Progress,
    steps: Steps | None = None,
    unseen: Sequence[View] = (),
    own: Sequence[Nuisances] = (),
) -> Attribution:
    """Fits everything that has to be, and chooses; flights held out, with ``own`` nuisances, have a say but no fit."""
    candidates, trier = candidates_of(views[0].simulator, views), Trier(nuisances, steps or Steps(), unseen, own)
    progress(0.0, "derivatives within their tolerances")
    base = trier.trial(blank(views, nuisances), [])
    chosen, stages, frontier = base, [], [base]
    for count, (width, most) in enumerate(_STAGES):
        looks = trier.looks_upon(frontier[:width], candidates, _share_of(progress, count))
        tried = trier.finish(_likeliest(looks, most), _share_of(progress, count))
        candidates = _narrowed(candidates, [look for _, look in looks])
        stages.append([trial for _, trial in tried])
        better = [t for upon, t in tried if accepted(base, upon, t) and _likelier(t, chosen)]
        if not better:
            break
        chosen, frontier = better[0], better
    progress(0.8, "whether another effect would do as well")
    late = [candidate for candidate in candidates if candidate.effect in BETWEEN]
    chosen, causes, doubted = _believed(trier, base, chosen, stages, late)
    before, left = structure_of(base.fit, chosen.fit), structure_of(chosen.fit)
    ranked, corrected = _ranked(base, stages[0]), unbiased(chosen.fit)
    return Attribution(base, chosen, corrected, before, left, causes, doubted, ranked, tuple(stages[0]))


def _share_of(progress: Progress, count: int) -> Progress:
    """Progress of one of the stages as that of all."""
    return lambda share, text: progress((count + share) / (len(_STAGES) + 1.0), text)


@dataclass(frozen=True)
class Trier:
    """Fits sets of candidates, the nuisances always along."""

    nuisances: Nuisances
    steps: Steps
    unseen: Sequence[View] = ()  # flights held out, and what is allowed for in each
    own: Sequence[Nuisances] = ()
    known: dict[frozenset[str], Trial] = field(default_factory=dict)  # by the labels of the set
    seen: dict[frozenset[str], dict[str, Look]] = field(default_factory=dict)  # upon such a set, by label

    def trial(self, fit: Fit, candidates: Sequence[Candidate], look: Look | None = None) -> Trial:
        """A set of candidates fitted from where another fit stands; what is added to the set starts at its look."""
        _, added, start = look or (0.0, None, ())
        wanted = [*candidates, *([added] if added else [])]
        labels = frozenset(c.label for c in wanted)
        if labels not in self.known:
            done = self.steps.polished(with_candidates(fit, wanted, self.nuisances, start))
            if added is not None and (moved := sought(done, added)) is not done:
                done = self.steps.polished(moved)
            self.known[labels] = Trial(done, judged(done, self.unseen, self.own))
        return replace(self.known[labels], added=added)

    def looks(self, current: Trial, candidates: Sequence[Candidate], progress: Progress) -> list[Look]:
        """A first look at each, the best first: what it takes away where the nuisances can do no more."""
        seen = self.seen.setdefault(frozenset(c.label for c in current.fit.candidates), {})
        fresh = [c for c in candidates if c.label not in seen]

        def work() -> dict[str, list[float]]:
            problem = Projected(current.fit)
            looks = _spread(
                lambda candidate: _first_look(current.fit, problem, candidate),
                fresh,
                lambda s: progress(0.5 * s, "a first look at every effect"),
            )
            return {candidate.label: [cost, *start] for cost, candidate, start in looks}

        if fresh:
            table = self.steps.table(current.fit, [c.label for c in fresh], work)
            seen.update({c.label: (table[c.label][0], c, tuple(table[c.label][1:])) for c in fresh if c.label in table})
        return sorted((seen[c.label] for c in candidates if c.label in seen), key=lambda look: look[0])

    def looks_upon(
        self, frontier: Sequence[Trial], candidates: Sequence[Candidate], progress: Progress
    ) -> list[tuple[Trial, Look]]:
        """First looks at each upon each of several explanations, the best first; every set of effects once."""
        found: list[tuple[Trial, Look]] = []
        for i, current in enumerate(frontier):
            rest = [c for c in candidates if c.effect not in current.fit.effects]
            part = lambda share, text, i=i: progress((i + share) / len(frontier), text)  # noqa: E731
            found += [(current, look) for look in self.looks(current, rest, part)]
        best: dict[frozenset[str], tuple[Trial, Look]] = {}
        for current, look in sorted(found, key=lambda pair: pair[1][0]):
            labels = frozenset({look[1].label, *(c.label for c in current.fit.candidates)})
            best.setdefault(labels, (current, look))
        return list(best.values())

    def upon(self, current: Trial, look: Look) -> Trial | None:
        """A candidate added to an explanation; None where no numbers come of it.

        Slopes of a mode that feeds itself grow without end: such a set predicts nothing, and is no explanation.
        """
        try:
            return self.trial(current.fit, current.fit.candidates, look)
        except np.linalg.LinAlgError:
            return None

    def beside(self, chosen: Trial, rival: Candidate) -> Trial | None:
        """A rival added to what was chosen; None where no numbers come of it."""
        (look,) = self.looks(chosen, [rival], lambda s, t: None)
        return self.upon(chosen, look)

    def finish(self, looks: Sequence[tuple[Trial, Look]], progress: Progress) -> list[tuple[Trial, Trial]]:
        """What was looked at, fitted to the end, after what it was looked at upon; the most probable first."""
        trials = _spread(
            lambda pair: (pair[0], self.upon(*pair)),
            looks,
            lambda s: progress(0.5 + 0.5 * s, "the likeliest effects"),
        )
        done = [(current, trial) for current, trial in trials if trial is not None]
        return sorted(done, key=lambda pair: -pair[1].evidence.total)


def _likeliest(looks: Sequence[tuple[Trial, Look]], most: int) -> list[tuple[Trial, Look]]:
    """The best looks upon each explanation; one effect in many shapes leaves room for others."""
    seen: Counter[tuple[int, str]] = Counter()
    kept = []
    for current, look in looks:
        effect = look[1].effect
        if seen[id(current), ""] < most and seen[id(current), effect] < _SHAPES:
            seen.update([(id(current), ""), (id(current), effect)])
            kept.append((current, look))
    return kept


def _narrowed(candidates: Sequence[Candidate], looks: Sequence[Look]) -> list[Candidate]:
    """The candidates with one start each where it is the onset that they differ in: looking at all again costs most."""
    best = {candidate.label: start for _, candidate, start in reversed(looks)}
    return [
        replace(c, starts=(best[c.label],)) if c.effect in PER_CONTROL and c.label in best else c for c in candidates
    ]


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


def _likelier(trial: Trial, other: Trial) -> bool:
    """Whether a trial predicts better than another, beyond doubt."""
    return bool(probabilities([trial.evidence.scores, other.evidence.scores])[0] > _SURE)


def accepted(base: Trial, without: Trial, trial: Trial) -> bool:
    """Whether a trial predicts better than what it was tried upon, beyond doubt, and by enough to matter.

    Also of what the commands foretell, having been picked from so many: gusts can fake the rest, and where the model is
    not exact every manoeuvre repeats the last one's error.
    """
    if _trifling(trial) or not _likelier(trial, without):
        return False
    matters = _matters_in_gusts(without, trial) if _in_gusts(trial) else _matters(without, trial)
    if not np.any(matters & (_contributed(base, without, trial) > MATERIAL_OF_ALL)):
        return False
    return advantage(trial.fit, without.fit) > _SURELY + _MANY


def _matters(without: Trial, trial: Trial) -> NDArray[np.bool_]:
    """Channels (12,) on which a trial takes enough of the remainder away."""
    left, motion = power_left(without.evidence), _motion(trial)
    gone = left - power_left(trial.evidence)
    return np.asarray(((gone > MATERIAL * left) & (gone > NOTICED**2 * motion)) | (gone > _PLAIN**2 * motion))


def _matters_in_gusts(without: Trial, trial: Trial) -> NDArray[np.bool_]:
    """The same, of forces and moments by what of the remainder is structure: the rest is weather."""
    before, after = structure_of(without.fit, trial.fit), structure_of(trial.fit)
    scale = power_left(without.evidence) / np.maximum(before.total, 1e-300)
    gone = before.coherent - after.coherent
    structured = (gone > MATERIAL * before.coherent) & (gone * scale > NOTICED**2 * _motion(trial))
    forces = np.arange(len(CHANNELS)) < len(COEFFICIENTS)
    return np.where(forces, structured, _matters(without, trial))


def _motion(trial: Trial) -> Array:
    """Power (12,) of what was measured, about the windows' means."""
    return np.asarray(sum((np.abs(v.measured[:, 1:]) ** 2).sum(axis=(0, 1)) for v in trial.evidence.views))


def _in_gusts(trial: Trial) -> bool:
    return any(gusty(view) for view in trial.fit.views)


def _contributed(base: Trial, without: Trial, trial: Trial) -> Array:
    """Power (12,) that comes back when what a trial has more than another is taken away, the others as they are.

    As a share of what nuisances alone leave, which do their best. The others would bend to hold what is gone: a lag
    twice as long for an engine half as strong.
    """
    kept = [c for c in trial.fit.candidates if c.effect in without.fit.effects]
    lacking = replace(with_candidates(trial.fit, kept, base.fit.nuisances, ()), power=without.fit.power)
    points = Projected(lacking).points(lacking.values)
    back, now, whole = (_powers(trial.fit, some) for some in (points, trial.fit.points, base.fit.points))
    return np.asarray(np.max((back - now) / np.maximum(whole, 1e-300), axis=0))


def _powers(fit: Fit, points: Sequence[Array]) -> Array:
    """Power (2, 12) that parameters leave of the flights, and without the means, beside which all else may be small."""
    residuals = [view.residual(point) for view, point in zip(fit.views, points, strict=True)]
    swinging = [np.concatenate([0.0 * r[:, :1], r[:, 1:]], axis=1) for r in residuals]
    return np.array([sum(power_of(r) for r in some) for some in (residuals, swinging)])


def _trifling(trial: Trial) -> bool:
    """Whether what was added is a time within one sample of the slowest topic: a matter of sampling."""
    if trial.added is None or trial.added.effect not in TIMES:
        return False
    slowest = min(min(v.flight.actuator_rate, v.flight.air_rate) for v in trial.fit.views)
    return bool(abs(trial.fit.points[0][trial.added.indices[0]]) < 1.0 / slowest)


def power_left(evidence: Evidence) -> Array:
    """Power (12,) of what is left on flight not fitted."""
    return np.asarray(sum(power_of(r) for r in evidence.residuals))


def _first_look(fit: Fit, problem: Projected, candidate: Candidate) -> Look:
    """What is left after one Gauss-Newton step from the best start, of the candidate and of all that is known so far.

    What is known so far must be let move along: alone it has bent to hold the other's share, and would hide it.
    """
    if not candidate.indices:
        widened = with_candidates(fit, [*fit.candidates, candidate], fit.nuisances, ())
        problem = Projected(widened)
        return problem.deviance(problem.residual(widened.values)), candidate, ()
    low, high = bounds(fit.views[0].simulator, (*fit.indices, *candidate.indices))
    best: Look = (np.inf, candidate, candidate.starts[0])
    look = problem.looking(candidate)
    for start in candidate.starts:
        values = np.concatenate([fit.values, start])
        rows = look.ahead(values)
        step = np.linalg.lstsq(look.jacobian(values), -rows, rcond=None)[0]
        stepped = np.clip(values + step, low, high)
        for there, left in ((values, rows), (stepped, look.residual(stepped))):
            deviance = look.deviance(left)
            if deviance < best[0]:
                best = (deviance, candidate, tuple(there[fit.values.size :].tolist()))
    return best


@dataclass(frozen=True)
class Place:
    """A cause's place in the explanation: what is left without it, and all that was tried in its stead."""

    candidate: Candidate
    without: Trial
    rivals: tuple[Trial, ...]


def _refined(
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
    for _ in range(_SWEEPS):
        places = tuple(_place(trier, base, chosen, c, stages[0], pool) for c in chosen.fit.candidates)
        better = _replacement(base, chosen, places, barred)
        if better is None:
            return chosen, places
        chosen = better
    return chosen, tuple(_place(trier, base, chosen, c, stages[0], pool) for c in chosen.fit.candidates)


def _believed(
    trier: Trier, base: Trial, chosen: Trial, stages: Sequence[list[Trial]], late: Sequence[Candidate]
) -> tuple[Trial, tuple[Cause, ...], tuple[Cause, ...]]:
    """The explanation without what is less likely to be there than not, and such causes, one after another.

    A rival that can be believed takes the place of each, where there is one, and one that is likelier that of any.
    """
    doubted: list[Cause] = []
    yielded: frozenset[str] = frozenset()  # labels of what made way
    while True:
        barred = frozenset(cause.candidate.label for cause in doubted)
        chosen, places = _refined(trier, base, chosen, stages, late, barred | yielded)
        causes = [_cause(trier, chosen, place, barred) for place in places]
        second = [cause for cause in causes if cause.likelier and cause.candidate.label not in yielded]
        worst = min(causes, key=lambda cause: cause.grounds.credence, default=None)
        if second:
            out, otherwise = second[0], chosen
        elif worst is not None and worst.grounds.credence < LIKELY:
            out, otherwise = worst, places[causes.index(worst)].without
            doubted.append(worst)
        else:
            return chosen, tuple(sorted(causes, key=lambda cause: -cause.probability)), tuple(doubted)
        yielded |= {out.candidate.label}
        chosen = _instead(base, places[causes.index(out)], out, barred | yielded) or otherwise


def _instead(base: Trial, place: Place, cause: Cause, barred: frozenset[str]) -> Trial | None:
    """The likeliest rival that can be believed in a cause's place, None where there is none."""
    likely = dict(cause.alternatives)
    rivals = [t for t in place.rivals if t.added and t.added.label not in barred and accepted(base, place.without, t)]
    for trial in sorted(rivals, key=lambda t: (-likely.get(t.added.effect if t.added else "", 0.0), -t.evidence.total)):
        if _grounds(trial, place.without, trial.added).credence >= LIKELY:
            return trial
    return None


def _grounds(trial: Trial, without: Trial, candidate: Candidate | None) -> Grounds:
    """What speaks for a candidate that a trial has more than another."""
    assert candidate is not None
    return Grounds.of(candidate.effect, advantage(trial.fit, without.fit), adequacy_of(trial.fit, candidate))


def _place(
    trier: Trier, base: Trial, chosen: Trial, candidate: Candidate, first: list[Trial], pool: list[Candidate]
) -> Place:
    """Against the likeliest rivals, and where the response is late against all that could make it so."""
    others = [c for c in chosen.fit.candidates if c is not candidate]
    without = trier.trial(chosen.fit, others) if others else base
    rest = [c for c in pool if c.effect not in without.fit.effects]
    looks = trier.looks_upon([without], rest, lambda s, t: None)
    likely = looks[:_RIVALS] if others else []
    late = [(t, look) for t, look in looks[len(likely) :] if {look[1].effect, candidate.effect} <= BETWEEN]
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
    ahead = {id(t): t.evidence.total - chosen.evidence.total + advantage(t.fit, chosen.fit) for t in rivals}
    best = max(rivals, key=lambda trial: ahead[id(trial)], default=None)
    return best if best is not None and ahead[id(best)] > _CLEARLY else None


def _cause(trier: Trier, chosen: Trial, place: Place, barred: frozenset[str]) -> Cause:
    """Its probability, summed over all sets of effects that were tried with it, and who else could be to blame.

    A rival is to blame instead only as far as it does not predict still better beside the cause: what adds up is no
    alternative (Hoeting, Madigan, Raftery & Volinsky (1999), Statistical Science 14(4), eq. 1, over sets).
    """
    candidate = place.candidate
    others = barred | {candidate.label}
    rivals = [t for t in place.rivals if t.added is not None and t.added.label not in others]
    instead = _shares([chosen], rivals)[1:]
    strong = [t for t, share in zip(rivals, instead, strict=True) if share > _WORTH_TRYING]
    tried = [trier.beside(chosen, t.added) for t in strong if t.added and t.added.effect != candidate.effect]
    sets = [chosen, *(trial for trial in tried if trial is not None)]
    odds = [prior(candidate.effect)] * len(sets) + [prior(t.added.effect) for t in rivals if t.added] + [1.0]
    shares = np.array(odds) * _shares(sets, [*rivals, place.without])
    shares = shares / shares.sum()
    by_effect = {candidate.effect: float(shares[: len(sets)].sum())}
    for trial, share in zip(rivals, shares[len(sets) : -1], strict=True):
        effect = trial.added.effect if trial.added else ""
        by_effect[effect] = by_effect.get(effect, 0.0) + float(share)
    rivals_left = sorted(((e, p) for e, p in by_effect.items() if e != candidate.effect), key=lambda pair: -pair[1])
    taken = np.maximum(power_left(place.without.evidence) - power_left(chosen.evidence), 0.0)
    grounds = _grounds(chosen, place.without, candidate)
    return Cause(candidate, by_effect[candidate.effect], taken, tuple(rivals_left), grounds, place.rivals)


def _shares(sets: Sequence[Trial], others: Sequence[Trial]) -> Array:
    """Probabilities of sets of effects that hold a cause, then of others that do not.

    Each is as probable, beside the likeliest, as it is by prediction or by what the commands foretell, whichever is
    more: what either cannot exclude is not excluded.
    """
    predicted = probabilities([t.evidence.scores for t in (*sets, *others)])
    best = int(np.argmax(predicted[: len(sets)]))
    ahead = np.array([advantage(sets[best].fit, t.fit) for t in others])
    foretold = np.zeros(predicted.size)
    lead = min(float(ahead.min(initial=0.0)), 0.0)
    foretold[best], foretold[len(sets) :] = np.exp(lead), np.exp(lead - ahead)
    shares = np.maximum(predicted / predicted.max(), foretold)
    return np.asarray(shares / shares.sum())


def _ranked(base: Trial, trials: Sequence[Trial]) -> tuple[tuple[str, float], ...]:
    """Every effect that was fitted to the end as the only one, with its probability; none among them."""
    scores = [*(t.evidence.scores for t in trials), base.evidence.scores]
    shares = probabilities(scores)
    labels = [*(t.added.label for t in trials if t.added), "none"]
    return tuple(sorted(zip(labels, shares.tolist(), strict=True), key=lambda pair: -pair[1]))
