"""What flight not fitted says of an explanation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sysid_node.gap.estimation.nuisances import HeldOutFlight
from sysid_node.gap.estimation.predictive_density import Evidence, FlightEvidence, held_out_evidence
from sysid_node.gap.instruments.liml import liml_estimate
from sysid_node.gap.instruments.overidentification import OveridentificationTest
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.selection.forward_selection import Attribution
from sysid_node.gap.validation import spectral_error
from sysid_node.gap.validation.kfold import kfold_evidence
from sysid_node.gap.validation.simulation_error import simulation_gap, weather_suffices
from sysid_node.gap.validation.spectral_error import Gap


@dataclass(frozen=True)
class Check:
    """Evidence of the derivatives alone and of the whole explanation, and the gap, on the same flights."""

    base: Evidence
    final: Evidence
    gap: Gap  # of forces, moments and kinematics by frequency
    weather_suffices: bool = False  # whether weather and sensors' noise are all of it

    @property
    def models(self) -> tuple[ResidualModel, ...]:
        """The flights' residual models."""
        return tuple(flight.model for flight in self.base.flights)

    @cached_property
    def simulation_gap(self) -> Gap | None:
        """The gap of short flights."""
        return simulation_gap(self.base, self.final)

    @property
    def gaps(self) -> list[Gap]:
        """By either measure."""
        return [self.gap, *([self.simulation_gap] if self.simulation_gap else [])]

    def as_in_file(self, left: OveridentificationTest) -> Check:
        """The same of the aircraft file as it is."""
        filed = (FlightEvidence.throughout(model, model.simulator.neutral()) for model in self.models)
        base = replace(self.base, flights=tuple(filed))
        return replace(self, base=base, final=base, gap=spectral_error.gap_of(base, base, left))


def check(attribution: Attribution, held_out: Sequence[HeldOutFlight]) -> Check:
    """On flights held out; without these, on parts of the flights fitted, each by a fit to the others."""
    if held_out:
        fits = liml_estimate(attribution.base.fit), attribution.corrected
        base, final = (held_out_evidence(fit, held_out) for fit in fits)
    else:
        base = kfold_evidence(attribution.base.evidence, liml_estimate(attribution.base.fit))
        final = kfold_evidence(
            attribution.chosen.evidence, attribution.corrected, filed=attribution.keeps_file_derivatives
        )
    return Check(base, final, spectral_error.gap_of(base, final, attribution.structure_left))


def validate(
    attribution: Attribution, models: Sequence[ResidualModel], held_out: Sequence[HeldOutFlight]
) -> tuple[Attribution, Check]:
    """What flight not fitted leaves of an explanation.

    Nothing is blamed where weather and noise are all of the gap, nor what by neither measure predicts flight better
    than the derivatives within their tolerances, or by one of them no better than the file; and derivatives that do
    worse than the file leave the file as it is. (In gusts derivatives that these have biased seem the better by
    frequency.)
    """
    with ThreadPoolExecutor(1) as pool:
        weather = pool.submit(weather_suffices, [*models, *(flight.model for flight in held_out)])
        attribution, checked = _standing(attribution, held_out)
    if weather.result():
        attribution = attribution.without_causes().as_in_file()
        return attribution, replace(
            check(attribution, held_out).as_in_file(attribution.structure_left), weather_suffices=True
        )
    if not attribution.causes and any(g.tolerances > g.before for g in checked.gaps):
        attribution = attribution.as_in_file()
        checked = checked.as_in_file(attribution.structure_left)
    return attribution, checked


def _standing(attribution: Attribution, held_out: Sequence[HeldOutFlight]) -> tuple[Attribution, Check]:
    """What of an explanation stands, and what flight not fitted says of it.

    The first that predicts better: all causes; the same with sizes as least squares has them; without the least
    probable one; none. Each is also held beside the file's own derivatives, and passed over where its predictions of
    flight not fitted are no numbers.
    """
    for explanation in _explanations(attribution):
        try:
            found = explanation, check(explanation, held_out)
        except np.linalg.LinAlgError:
            continue
        if any(g.tolerances > g.before for g in found[1].gaps):
            found = _beside_the_file(*found, held_out)
        if _better(found[1]):
            return found
    bare = attribution.without_causes()
    return bare, check(bare, held_out)


def _explanations(attribution: Attribution) -> Iterator[Attribution]:
    """An explanation, then what could stand in its stead."""
    if attribution.causes:
        yield attribution
        if attribution.corrected is not attribution.chosen.fit:
            yield attribution.by_least_squares()
    if len(attribution.causes) > 1:
        yield attribution.without_least_probable()


def _better(checked: Check) -> bool:
    """Whether causes predict better than the derivatives by one of the measures, and than the file by both."""
    return any(g.after < g.tolerances for g in checked.gaps) and all(g.after < g.before for g in checked.gaps)


def _beside_the_file(
    attribution: Attribution, checked: Check, held_out: Sequence[HeldOutFlight]
) -> tuple[Attribution, Check]:
    """The causes beside the file's own derivatives, where these do better than the derivatives that were fitted."""
    explanation = attribution.with_file_derivatives()
    try:
        found = check(explanation, held_out)
    except np.linalg.LinAlgError:
        return attribution, checked
    if not found.gaps[-1].after < checked.gaps[-1].after:
        return attribution, checked
    filed = found.as_in_file(attribution.structure_left)
    gap = spectral_error.gap_of(filed.base, found.final, attribution.structure_left)
    return explanation, replace(found, base=replace(filed.base, scores=found.base.scores), gap=gap)
