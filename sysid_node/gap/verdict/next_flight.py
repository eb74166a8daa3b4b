"""What to fly next: of a few manoeuvres, the one that best separates the effects that this flight confuses.

Each manoeuvre is flown by the corrected simulator in still air. The separation of a cause from an alternative is what
is left of the cause's response, in standard deviations of the sensors' noise, after the alternative, the derivatives
within their tolerances and the biases were fitted to it (the distance between two models, linearised: Atkinson &
Fedorov (1975), Biometrika 62(1)).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from sysid_node.dynamics.atmosphere import air_density
from sysid_node.errors import InputError
from sysid_node.excite.manoeuvre import THROTTLE
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.spectral_weights import real_rows, weights
from sysid_node.gap.flightdata.gap_flight import with_inferred_angles
from sysid_node.gap.residuals.build import residual_model_like
from sysid_node.gap.residuals.parameter_priors import prior
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.selection.causes import Cause
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.gap.selection.forward_selection import Attribution
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds
from sysid_node.sim import Simulator
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie
from sysid_node.sim.model.parameters import stated

#: Amplitude of the proposed deflections, as a share of each surface's limit, unless the words say otherwise.
_USUAL = 0.2

#: Manoeuvres in words, shape, width (s), share of the usual amplitude, and whether the throttle is stepped, too.
_PROPOSALS = (
    ("3-2-1-1 on each surface in turn", "3211", 0.3, 1.0, False),
    ("quick 3-2-1-1 on each surface in turn, 0.12 s the shortest step", "3211", 0.12, 1.2, False),
    ("slow 3-2-1-1 on each surface in turn, 0.8 s the shortest step", "3211", 0.8, 0.7, False),
    ("3-2-1-1 on each surface in turn at twice the usual deflection", "3211", 0.3, 2.0, False),
    ("3-2-1-1 on each surface in turn at half the usual deflection", "3211", 0.3, 0.5, False),
    ("3-2-1-1 on each surface in turn while the throttle is stepped up and down", "3211", 0.3, 1.0, True),
)

#: What to fly where no pair of effects is confused.
_LARGER = "3-2-1-1 on each surface in turn, larger and at two airspeeds, in still air"

#: Amplitude of the throttle's steps, as a share of full throttle.
_THROTTLE_STEP = 0.25


@dataclass(frozen=True)
class Proposal:
    """A manoeuvre in words, the least separation (sigmas) of any pair of effects by it, and by the flight flown."""

    words: str
    separation: float
    flown: float


def advice(verdict: str, attribution: Attribution) -> str:
    """What to fly next, in words; empty where nothing is in doubt."""
    pairs = [(cause.candidate, each.fit) for cause in attribution.causes for each in _confused(cause)]
    best = propose(attribution.chosen.fit, pairs) if pairs and verdict != "no_gap" else None
    return advice_in_words(verdict, _listed(attribution) if pairs else "", best)


def advice_in_words(verdict: str, confused: str, best: Proposal | None, thresholds: Thresholds = THRESHOLDS) -> str:
    """The words for a verdict, the effects that are ``confused`` (empty where none are) and the best proposal."""
    if verdict == "no_gap" or (verdict == "explained" and not confused):
        return ""
    if best is None:
        return _LARGER
    if best.separation < thresholds.verdict.separated:
        return (
            f"no manoeuvre distinguishes {confused} (at most {best.separation:.2g} standard deviations): what they "
            "do in flight is the same; measure on the ground"
        )
    if best.separation <= best.flown:
        return (
            f"the same again, longer and in still air: no other manoeuvre distinguishes {confused} better than "
            f"those flown ({best.flown:.3g} standard deviations of the sensors' noise)"
        )
    return (
        f"{best.words}, in still air: distinguishes {confused} by {best.separation:.3g} standard deviations or "
        f"more, the manoeuvres flown by {best.flown:.3g}"
    )


def _listed(attribution: Attribution) -> str:
    """The causes beside which alternatives are named, and these, with commas between."""
    doubtful = [cause for cause in attribution.causes if named(cause)]
    effects = dict.fromkeys(e for cause in doubtful for e in (cause.candidate.effect, *named(cause)))
    return ", ".join(effect.replace("_", " ") for effect in effects)


def named(cause: Cause) -> list[str]:
    """Effects that are named beside a cause as alternatives to it."""
    return [effect for effect, probability in cause.alternatives if probability > THRESHOLDS.verdict.named]


def _confused(cause: Cause) -> list[FittedSet]:
    """The first fitted set of each effect that is named beside a cause."""
    best: dict[str, FittedSet] = {}
    for fitted in cause.alternative_sets:
        if fitted.added is not None and fitted.added.effect in named(cause):
            best.setdefault(fitted.added.effect, fitted)
    return list(best.values())


def propose(fit: CandidateFit, pairs: Sequence[tuple[Candidate, CandidateFit]]) -> Proposal | None:
    """The best of the proposals for pairs of a cause and the fit of an alternative; none where none can be flown."""
    model = fit.models[0]
    flights = list(zip(fit.models, fit.flights, strict=True))
    flown = min(math.hypot(*(_separation(m, f.point, *pair, fit) for m, f in flights)) for pair in pairs)
    found: list[Proposal] = []
    for words, shape, width, share, throttle in _PROPOSALS:
        try:
            planned = _flown(model, fit, _specs(model, shape, width, share, throttle))
        except InputError:
            continue  # it exceeds a limit of the aircraft file, or diverges
        found.append(Proposal(words, min(_separation(planned, fit.flights[0].point, *p, fit) for p in pairs), flown))
    return max(found, key=lambda proposal: proposal.separation, default=None)


def _specs(model: ResidualModel, shape: str, width: float, share: float, throttle: bool) -> list[str]:
    """The manoeuvre as arguments of ``sysid excite``: every four seconds the next surface, until the flight ends."""
    aircraft, duration = model.simulator.aircraft, model.record.duration
    surfaces = list(aircraft.controls)
    every = 4.0 * len(surfaces)
    specs = []
    for i, surface in enumerate(surfaces):
        start = 1.0 + 4.0 * i
        repeat = max(1, int((duration - start - 7.0 * width) // every) + 1)
        amplitude = share * _USUAL * (aircraft.controls[surface].limit or 0.3)
        specs.append(f"{shape}:{surface}:amplitude={amplitude:.4g}:width={width:g}:start={start:g}:every={every:g}:"
                     f"repeat={repeat}")  # fmt: skip
    if throttle and aircraft.throttle:
        specs.append(f"doublet:throttle:amplitude={_THROTTLE_STEP}:width=3:start=2:every=10:"
                     f"repeat={max(1, int((duration - 8.0) // 10.0) + 1)}")  # fmt: skip
    return specs


def _flown(model: ResidualModel, fit: CandidateFit, specs: list[str]) -> ResidualModel:
    """The residual model of the manoeuvre as the corrected simulator flies it in still air. Raises InputError."""
    simulator, record = model.simulator, model.record
    plan = parse_manoeuvre(specs, simulator.aircraft, simulator.rate, record.duration)
    deflections = np.zeros((len(record), len(simulator.commands)))
    deflections[:, :-1] = plan.surfaces()[: len(record)]
    throttle = simulator.aircraft.throttle
    if THROTTLE in plan.deflections and throttle is not None:
        deflections[:, -1] = (throttle.max_thrust or 1.0) * plan.deflections[THROTTLE][: len(record)]
    sortie = fly_sortie(simulator, deflections, SortieConditions(_effects(simulator, fit.flights[0].point), noise=0.0))
    outputs = np.asarray(sortie.flight.outputs)
    columns = {name: outputs[:, i] for i, name in enumerate(simulator.outputs)}
    columns |= {name: np.asarray(sortie.flight.commands)[:, i] for i, name in enumerate(_symbols(simulator))}
    columns["rho"] = np.asarray(air_density(-jnp.asarray(sortie.flight.states)[:, 2], jnp))
    flight = replace(model.flight, record=FlightRecord(record.time, columns), imu_rate=simulator.rate, source="")
    return residual_model_like(model, with_inferred_angles(simulator.aircraft, flight))


def _symbols(simulator: Simulator) -> tuple[str, ...]:
    """Names of the simulator's commands, as columns of a record."""
    return (*simulator.layout.symbols, "thrust")


def _effects(simulator: Simulator, point: Array) -> dict[str, dict[str, float]]:
    """The effects that act at parameters (P,), with their parameters within their bounds."""
    neutral = simulator.neutral()
    bounded = np.array([np.clip(x, p.lower, p.upper) for x, (_, p) in zip(point, simulator.parameters, strict=True)])
    acting = {e: p for i, (e, p) in enumerate(simulator.parameters) if p.switch and point[i] != neutral[i]}
    return {effect: stated(simulator.layout, bounded, effect) for effect in acting}


def _separation(
    model: ResidualModel, point: Array, cause: Candidate, alternative: CandidateFit, fit: CandidateFit
) -> float:
    """Distance (sigmas) of a cause's response at parameters (P,) from the nearest by an alternative and nuisances.

    Zero where a prediction diverges, so that nothing can be said of the distance.
    """
    neutral, entries = model.simulator.neutral(), list(cause.entries)
    instead = point.copy()
    instead[entries] = neutral[entries]
    added = [i for i in alternative.indices if i not in fit.indices]
    instead[added] = alternative.flights[0].point[added]
    weight = weights(np.where(model.axes, model.noise, 1.0))
    response = real_rows(model.predicted(point) - model.predicted(instead), weight).ravel()
    free = [*added, *(i for i in fit.nuisances.indices if i not in entries)]
    slopes = real_rows(model.slopes(instead, free), weight).reshape(response.size, -1)
    known = dict(zip(fit.nuisances.indices, fit.nuisances.sigma, strict=True))
    own = dict(zip(alternative.nuisances.indices, alternative.nuisances.sigma, strict=True))
    known |= {i: own[i] for i in alternative.widened}
    sigma = np.array([*prior(model.simulator, added)[1], *(known[i] for i in free[len(added) :])])
    matrix = np.vstack([slopes, np.diag(1.0 / sigma)])
    target = np.concatenate([response, np.zeros(sigma.size)])
    if not (np.isfinite(matrix).all() and np.isfinite(target).all()):
        return 0.0
    best = np.linalg.lstsq(matrix, target, rcond=None)[0]
    return float(np.linalg.norm(target - matrix @ best))
