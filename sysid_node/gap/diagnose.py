"""The whole diagnosis of a gap, and what ``gap.json`` holds of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.record import Array
from sysid_node.gap import close, localise
from sysid_node.gap.attribute import NOTICED, Attribution, Cause, Progress, Trial, attribute, power_left
from sysid_node.gap.close import Gap
from sysid_node.gap.confusion import Confusion, confusion_of
from sysid_node.gap.evidence import Evidence, held_out
from sysid_node.gap.fit import Fit
from sysid_node.gap.flights import RATE, Flight
from sysid_node.gap.localise import Shape
from sysid_node.gap.next_flight import propose
from sysid_node.gap.nuisance import Nuisances, nuisances_of
from sysid_node.gap.steps import Steps
from sysid_node.gap.structure import Structure, instrumented
from sysid_node.gap.view import CHANNELS, View, view_of
from sysid_node.sim import Simulator

#: Probability from which an effect counts as told apart from its rivals.
_TOLD_APART = 0.8

#: Share of the remainder on some axis that must be structure to matter, and its standard deviations above chance.
_STRUCTURED, _DEVIATIONS = 0.12, 6.0

#: Standard deviations above chance below which coherence is taken as chance.
_CHANCE = 4.0

#: Share of what tolerances and noise leave that the effects must take away for them to be the explanation.
_EXPLAINED = 0.5

#: Probability, with what is left over counted against it, below which no cause is said to explain.
_LIKELY = 0.5

#: A rival with this probability is named.
_NAMED = 0.03

#: Power over the sensors' noise below which a flight tells nothing, and below which nothing moves at all.
_TELLING = 6.0

#: Travel below which no surface counts as moved, rad.
_TRAVEL = 0.004

#: Separation, in standard deviations, from which a flight tells two effects apart.
_PARTED = 3.0

#: What to fly where no pair of effects is in doubt.
_LARGER = "3-2-1-1 on each surface in turn, larger and at two airspeeds, in still air"

#: Ratio of measured to expected mean lift beyond which a flight is another aircraft's.
_LIFT = 2.5


@dataclass(frozen=True)
class Diagnosis:
    """What was found. ``views`` are the flights on which the gap is measured, with the evidence there."""

    aircraft: Aircraft
    verdict: str
    gap: Gap
    where: list[dict[str, Any]]
    attribution: Attribution
    shape: Shape | None
    views: tuple[View, ...]
    base: Evidence
    final: Evidence
    next_flight: str
    held_out: bool
    confusion: Confusion


def diagnose(
    aircraft: Aircraft,
    flights: Sequence[Flight],
    holdouts: Sequence[Flight],
    progress: Progress = lambda s, t: None,
    keep: Path | None = None,
) -> Diagnosis:
    """Diagnoses flights, and measures the gap on flights held out; without these, by parts of the same flights.

    ``keep``: a folder for finished steps, from which an interrupted diagnosis goes on; empty again at the end.
    Raises InputError: an aircraft file without tolerances or of another aircraft, a held-out flight that is also
    fitted, a flight in which nothing moves.
    """
    _require_others(flights, holdouts)
    progress(0.0, "reading the flights as forces and moments")
    simulator = Simulator(aircraft, RATE)
    views = [_checked(view_of(simulator, flight)) for flight in flights]
    nuisances = nuisances_of(aircraft, views[0])
    steps = Steps.of(keep, views)
    attribution = attribute(views, nuisances, lambda s, t: progress(0.05 + 0.85 * s, t), steps)
    progress(0.92, "the gap on flight not fitted")
    unseen = [_checked(view_of(simulator, flight)) for flight in holdouts]
    own = [nuisances_of(aircraft, view) for view in unseen]
    check = _check(attribution, unseen, own)
    if attribution.causes and check.gap.after >= min(check.gap.before, check.gap.tolerances):
        attribution = attribution.without_causes()
        check = _check(attribution, unseen, own)
    if not attribution.causes and check.gap.tolerances > check.gap.before:
        attribution = attribution.as_filed()
        check = check.as_filed(attribution.left)
    verdict = _verdict(views, attribution, check)
    progress(0.95, "what to fly next")
    found = localise.where(attribution, [v.residual(simulator.neutral()) for v in views])
    flight = _next_flight(verdict, attribution)
    steps.forget()
    return Diagnosis(
        aircraft, verdict, check.gap, found, attribution, localise.missing(attribution), check.views, check.base,
        check.final, flight, bool(holdouts), confusion_of(attribution.base, attribution.trials),
    )  # fmt: skip


@dataclass(frozen=True)
class _Check:
    """What flight not fitted says of an explanation."""

    views: tuple[View, ...]
    base: Evidence
    final: Evidence
    gap: Gap

    def as_filed(self, left: Structure) -> _Check:
        """The same of the aircraft file as it is."""
        before = tuple(v.residual(v.simulator.neutral()) for v in self.views)
        base = replace(self.base, residuals=before)
        return replace(self, base=base, final=base, gap=close.gap_of(self.views, before, base, base, left))


def _check(attribution: Attribution, unseen: Sequence[View], own: Sequence[Nuisances]) -> _Check:
    """On flights held out; without these, on parts of the flights fitted, each by a fit to the others."""
    if unseen:
        base, final = (held_out(f, unseen, own) for f in (instrumented(attribution.base.fit), attribution.corrected))
    else:
        base, final = attribution.base.evidence, attribution.chosen.evidence
    views = base.views
    before = [v.residual(v.simulator.neutral()) for v in views]
    return _Check(views, base, final, close.gap_of(views, before, base, final, attribution.left))


def _require_others(flights: Sequence[Flight], holdouts: Sequence[Flight]) -> None:
    """Raises InputError where a held-out flight is one of those that are fitted."""
    for held in holdouts:
        for flight in flights:
            a, b = held.record, flight.record
            same = a.start_ns == b.start_ns and len(a) == len(b) and np.array_equal(a["az"], b["az"])
            if same or held.source == flight.source:
                raise InputError(
                    f"--holdout {held.source}: is the same flight as {flight.source}; hold out a flight that is not "
                    "fitted, or leave --holdout away to check on parts of the flight"
                )


def _checked(view: View) -> View:
    """The view. Raises InputError where nothing moves, or where the flight is another aircraft's."""
    commands = view.commands[:, :-1]
    travel = np.ptp(np.percentile(commands, [0.5, 99.5], axis=0), axis=0)
    if (travel < _TRAVEL).all():
        raise InputError(
            f"{view.flight.source}: no control surface moves by more than {travel.max():.2g} rad; fly a manoeuvre "
            "(sysid excite designs one)"
        )
    lift, expected = view.series[:, 0].mean(), view.predicted_series(view.simulator.neutral())[:, 0].mean()
    if not 1.0 / _LIFT < lift / expected < _LIFT:
        raise InputError(
            f"{view.flight.source}: mean CL is {lift:.2f} by the mass and wing area of "
            f"{view.simulator.aircraft.name!r}, not {expected:.2f} as in its file; another aircraft's flight?"
        )
    return view


def _excitation(view: View) -> Array:
    """Power over the sensors' noise, by coefficient that was measured."""
    power = (np.abs(view.measured[:, 1:]) ** 2).mean(axis=0).sum(axis=0)
    return np.asarray((power / view.noise[1:].sum(axis=0))[view.axes])


def _verdict(views: Sequence[View], attribution: Attribution, check: _Check) -> str:
    if max(_excitation(view).max() for view in views) < _TELLING:
        return "unsupported"
    if not attribution.causes:
        return "unknown_effect" if structured(attribution) else "no_gap"
    if check.final.total <= check.base.total or explained(attribution) < _EXPLAINED:
        return "unknown_effect"
    sure = [c.probability >= _TOLD_APART and probability(attribution, c) >= _LIKELY for c in attribution.causes]
    return "explained" if all(sure) else "ambiguous"


def structured(attribution: Attribution) -> bool:
    """Whether what is left holds structure that matters."""
    left, size = attribution.left, np.sqrt(_structure_left(attribution))
    return bool(np.any((left.share > _STRUCTURED) & (left.deviations > _DEVIATIONS) & (size > NOTICED)))


def explained(attribution: Attribution) -> float:
    """Share that the effects take away of what lies above the tolerances and is not noise, all channels together."""
    motion = _motion(attribution.chosen.evidence)
    gone = (power_left(attribution.base.evidence) - power_left(attribution.chosen.evidence)) / motion
    taken = max(float(gone.sum()), 0.0)
    whole = taken + float(_structure_left(attribution).sum())
    return taken / whole if whole > 0.0 else 1.0


def _structure_left(attribution: Attribution) -> Array:
    """Power (12,) of what is left and is structure beyond chance, as shares of the motion."""
    left, evidence = attribution.left, attribution.chosen.evidence
    share = np.where(left.deviations > _CHANCE, left.share, 0.0)
    return np.asarray(share * power_left(evidence) / _motion(evidence))


def _motion(evidence: Evidence) -> Array:
    """Power (12,) of what was measured, about the windows' means."""
    power = sum((np.abs(v.measured[:, 1:]) ** 2).sum(axis=(0, 1)) for v in evidence.views)
    return np.asarray(np.maximum(power, 1e-300))


def probability(attribution: Attribution, cause: Cause) -> float:
    """Of a cause, less by the share of the structure that is left and no listed effect explains."""
    return cause.probability * explained(attribution)


def parameters(fit: Fit, cause: Cause) -> dict[str, list[float]]:
    """Value and standard error of each of a cause's parameters, in the simulator's units."""
    simulator, places = fit.views[0].simulator, {index: place for place, index in enumerate(fit.indices)}
    errors = np.sqrt(np.diag(fit.covariance))
    if cause.candidate.indices:
        return {
            simulator.parameters[i][1].name: [float(fit.points[0][i]), float(errors[places[i]])]
            for i in cause.candidate.indices
        }
    ordered = [i for i, s in zip(fit.nuisances.indices, fit.nuisances.shared, strict=True) if s]
    ordered += [i for i, s in zip(fit.nuisances.indices, fit.nuisances.shared, strict=True) if not s]
    places = {index: len(fit.indices) + place for place, index in enumerate(ordered)}
    own = [i for i in ordered if simulator.parameters[i][0] == cause.candidate.effect]
    return {simulator.parameters[i][1].name: [float(fit.points[0][i]), float(errors[places[i]])] for i in own}


def document(found: Diagnosis) -> dict[str, Any]:
    """The content of gap.json."""
    gap, attribution = found.gap, found.attribution
    left = attribution.left
    return {
        "verdict": found.verdict,
        "aircraft": found.aircraft.name,
        "gap": {
            "before": gap.before,
            "tolerances": gap.tolerances,
            "after": gap.after,
            "noise_floor": gap.noise_floor,
            "shrink_percent": gap.shrink_percent,
            "ci95": list(gap.ci95),
            "per_channel": gap.per_channel,
            "window_s": found.views[0].windows.length,
            "held_out": found.held_out,
        },
        "air_motion": max(view.gusts for view in found.views),
        "where": found.where,
        "causes": [_cause(found, cause) for cause in attribution.causes],
        "candidates": [{"effect": label, "probability": p} for label, p in attribution.table],
        "unexplained": {
            "share": 1.0 - explained(attribution) if structured(attribution) else 0.0,
            "where": [w for w in found.where if w["station"] == "unexplained"][:3],
            "coherent_share": {c: float(s) for c, s in zip(CHANNELS, left.share, strict=True)},
        },
        "next_flight": found.next_flight,
    }


def _cause(found: Diagnosis, cause: Cause) -> dict[str, Any]:
    return {
        "effect": cause.candidate.effect,
        "label": cause.candidate.label,
        "station": cause.candidate.station,
        "parameters": parameters(found.attribution.corrected, cause),
        "probability": probability(found.attribution, cause),
        "gap_after": found.gap.after,
        "indistinguishable_from": _named(cause),
    }


def _next_flight(verdict: str, attribution: Attribution) -> str:
    """What to fly, by what is in doubt."""
    if verdict == "no_gap":
        return ""
    pairs = [(cause.candidate, rival.fit) for cause in attribution.causes for rival in _confused(cause)]
    if not pairs:
        return "" if verdict == "explained" else _LARGER
    best = propose(attribution.chosen.fit, pairs)
    if best is None:
        return _LARGER
    if best.separation < _PARTED:
        return (
            f"no manoeuvre parts {_listed(attribution)} (at most {best.separation:.2g} standard deviations): what they "
            "do in flight is the same; measure on the ground"
        )
    if best.separation <= best.flown:
        return (
            f"the same again, longer and in still air: no other manoeuvre parts {_listed(attribution)} better than "
            f"those flown ({best.flown:.3g} standard deviations of the sensors' noise)"
        )
    return (
        f"{best.words}, in still air: parts {_listed(attribution)} by {best.separation:.3g} standard deviations or "
        f"more, the manoeuvres flown by {best.flown:.3g}"
    )


def _listed(attribution: Attribution) -> str:
    """The causes in doubt and what is named beside them."""
    doubtful = [cause for cause in attribution.causes if _named(cause)]
    return ", ".join(dict.fromkeys(e for cause in doubtful for e in (cause.candidate.effect, *_named(cause))))


def _named(cause: Cause) -> list[str]:
    """Effects that are named beside a cause."""
    return [effect for effect, p in cause.alternatives if p > _NAMED]


def _confused(cause: Cause) -> list[Trial]:
    """The best trial of each effect that is named beside a cause."""
    best: dict[str, Trial] = {}
    for trial in cause.rivals:
        if trial.added is not None and trial.added.effect in _named(cause):
            best.setdefault(trial.added.effect, trial)
    return list(best.values())


__all__ = ["Diagnosis", "Trial", "diagnose", "document"]
