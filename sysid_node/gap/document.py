"""The content of gap.json, from a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.instruments.liml import liml_estimate
from sysid_node.gap.residuals.excited_axes import quiet_motions
from sysid_node.gap.residuals.residual_model import CHANNELS, COEFFICIENTS
from sysid_node.gap.selection.causes import Cause, variance_by_alternatives
from sysid_node.gap.short_flights.readings import length_of
from sysid_node.gap.validation.spectral_error import Gap
from sysid_node.gap.validation.standard_errors import standard_errors, with_standard_error
from sysid_node.gap.verdict.decision import unexplained_share
from sysid_node.gap.verdict.next_flight import named
from sysid_node.sim import Simulator
from sysid_node.sim.model.parameters import StatedParameter, stated_parameters


def document(found: Diagnosis) -> dict[str, Any]:
    """The content of gap.json."""
    attribution = found.attribution
    left, unexplained = attribution.structure_left, unexplained_share(found.scores)
    return {
        "verdict": found.verdict,
        "aircraft": found.aircraft.name,
        "gap": {
            **gap_content(found.size),
            "measured_by": "short_flights" if found.simulation_gap else "forces_and_kinematics",
            "window_s": length_of(found.models[0]) if found.simulation_gap else found.models[0].windows.length,
            "held_out": found.held_out,
            "measured_on": found.measured_on,
            "forces_and_kinematics": {**gap_content(found.gap), "window_s": found.models[0].windows.length},
        },
        "not_excited": quiet_motions(found.models),
        "air_motion": found.air_motion if found.models[0].axes[len(COEFFICIENTS) :].any() else None,
        "where": found.where,
        "causes": [_cause(found, cause) for cause in attribution.causes],
        "doubted": [_rejected(cause) for cause in attribution.rejected],
        "candidates": [
            {"effect": label, "probability": probability, "share": share} for label, probability, share in ranked(found)
        ],
        "unexplained": {
            "share": unexplained,
            "where": [w for w in found.where if w["station"] == "unexplained"][:3] if unexplained else [],
            "coherent_share": {c: float(s) for c, s in zip(CHANNELS, left.share, strict=True)},
        },
        "next_flight": found.next_flight,
        **_surrogate(found),
    }


def _surrogate(found: Diagnosis) -> dict[str, Any]:
    """How well the model of the user's simulator stands for it, on simulated flight held out, where there is one."""
    surrogate = found.surrogate
    if surrogate is None:
        return {}
    return {
        "surrogate": {
            "per_channel": surrogate.error.per_channel,
            "error": surrogate.error.total,
            "effects": list(surrogate.effects),
            "tables": [f"{t.coefficient} over {', '.join(t.over)}" for t in surrogate.tables],
            "fitted_s": surrogate.fitted_seconds,
            "held_out_s": surrogate.held_out_seconds,
        }
    }


def ranked(found: Diagnosis) -> list[tuple[str, float | None, float]]:
    """Effects that were fitted alone, the best first: label, probability that it is there, share of the probability.

    The shares rank how well the effects, and the derivatives within their tolerances ("none"), predict flight that was
    not fitted; one of them is always the best. Only what was weighed as a cause, or as an alternative to one, has a
    probability.
    """
    attribution = found.attribution
    effects = {each.added.label: each.added.effect for each in attribution.first_stage if each.added}
    weighed = (*attribution.rejected, *attribution.causes)
    as_alternative = {
        effect: share * cause.probability_of_any for cause in weighed for effect, share in cause.alternatives
    }
    as_cause = {cause.candidate.label: cause.probability for cause in weighed}
    return [
        (label, as_cause.get(label, as_alternative.get(effects.get(label, ""))), share)
        for label, share in attribution.ranking
    ]


def gap_content(gap: Gap) -> dict[str, Any]:
    """A gap's errors, shrinkage and intervals."""
    return {
        "before": gap.before,
        "tolerances": gap.tolerances,
        "after": gap.after,
        "noise_floor": gap.noise_floor,
        "shrink_percent": gap.shrink_percent,
        "ci95": list(gap.ci95),
        "intervals": {name: list(ends) for name, ends in gap.intervals.items()},
        "per_channel": gap.per_channel,
    }


def _cause(found: Diagnosis, cause: Cause) -> dict[str, Any]:
    return {
        "effect": cause.candidate.effect,
        "label": cause.candidate.label,
        "station": cause.candidate.station,
        "parameters": parameters(found.attribution.size_fit, cause, found.attribution.causes),
        **_known(found, cause),
        "probability": cause.probability,
        "gap_after": found.size.after,
        "indistinguishable_from": named(cause),
        "grounds": _grounds(cause),
    }


def _known(found: Diagnosis, cause: Cause) -> dict[str, Any]:
    """What the aircraft file states of a cause's parameters, where it does."""
    values = believed(cause, found.attribution.size_fit.simulator)
    return {"believed": values} if values else {}


def _rejected(cause: Cause) -> dict[str, Any]:
    """A rejected effect (``doubted``), with its size in the explanation that it was part of."""
    return {
        "effect": cause.candidate.effect,
        "label": cause.candidate.label,
        "parameters": parameters(liml_estimate(cause.fit), cause),
        "probability": cause.probability,
        "indistinguishable_from": named(cause),
        "grounds": _grounds(cause),
    }


def _grounds(cause: Cause) -> dict[str, Any]:
    """What the probability of a cause follows from."""
    evidence = cause.evidence
    return {
        "share": cause.share,
        "log_bayes_factor": evidence.log_bayes_factor,
        "tolerances": evidence.by_tolerances,
        "misspecification": evidence.misspecification,
        "flexible": evidence.flexible,
        "imitation": cause.imitation,
    }


def parameters(fit: CandidateFit, cause: Cause, causes: Sequence[Cause] = ()) -> dict[str, list[float]]:
    """Value and standard error of each of a cause's parameters by name, in the units of the aircraft file's effects.

    ``fit`` holds the cause, and ``causes`` are all that it is stated beside. A cause that only widens the tolerances of
    derivatives has these as its parameters. What acts on controls has a parameter for each control on which the cause
    acts.
    """
    places = {index: place for place, index in enumerate(fit.indices)}
    entries = cause.candidate.indices
    if not entries:
        nuisances = list(zip(fit.nuisances.indices, fit.nuisances.shared, strict=True))
        ordered = [i for i, shared in nuisances if shared] + [i for i, shared in nuisances if not shared]
        places = {index: len(fit.indices) + place for place, index in enumerate(ordered)}
        entries = tuple(i for i in ordered if i in cause.candidate.widened)
    errors, point = standard_errors(fit), fit.flights[0].point
    otherwise = np.sqrt(variance_by_alternatives(cause, causes))
    found = {}
    for name, parameter in stated_by(cause.candidate, fit.simulator, entries).items():
        (moved,) = set(parameter.entries) & set(entries)
        total = float(point[list(parameter.entries)].sum())
        value, error = with_standard_error(name, total, float(np.hypot(errors[places[moved]], otherwise[moved])))
        if not parameter.inverse:
            found[name] = [value, error]
        elif value > 0.0:  # of 1 / x
            found[name] = [1.0 / value, error / value**2]
    return found


def stated_by(candidate: Candidate, simulator: Simulator, entries: Sequence[int]) -> dict[str, StatedParameter]:
    """The parameters of a candidate as users state them: those that hold one of these entries of the vector."""
    every = stated_parameters(simulator.layout, candidate.effect)
    return {name: each for name, each in every.items() if not set(each.entries).isdisjoint(entries)}


def believed(cause: Cause, simulator: Simulator) -> dict[str, float]:
    """What the aircraft file states of a cause's parameters, by name; empty where it does not state the effect."""
    if cause.candidate.effect not in simulator.aircraft.effect_values():
        return {}
    stated = stated_by(cause.candidate, simulator, cause.candidate.entries)
    values = {name: each.value(simulator.neutral()) for name, each in stated.items()}
    return {name: value for name, value in values.items() if np.isfinite(value)}
