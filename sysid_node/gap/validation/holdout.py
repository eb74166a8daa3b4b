"""Validation of an explanation on flight that was not fitted: flights held out, or parts of the same flights.

``validation.standing`` decides from the errors there what of the explanation stands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from sysid_node.gap.estimation.nuisances import HeldOutFlight
from sysid_node.gap.estimation.predictive_density import Evidence, FlightEvidence, held_out_evidence
from sysid_node.gap.instruments.liml import liml_estimate
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.selection.forward_selection import Attribution
from sysid_node.gap.validation import spectral_error
from sysid_node.gap.validation.handed_on import of_corrected_file
from sysid_node.gap.validation.kfold import kfold_evidence
from sysid_node.gap.validation.simulation_error import simulation_gap, weather_suffices
from sysid_node.gap.validation.spectral_error import Gap
from sysid_node.gap.validation.standard_errors import scattered_errors
from sysid_node.gap.validation.standing import (
    ErrorTable,
    attitude_errors,
    causes_exceed_weather,
    causes_stand,
    file_derivatives_suit_causes,
    file_predicts_better,
    is_needless,
    shares_taken_away,
)

#: The validation of one explanation. Raises numpy.linalg.LinAlgError where its predictions are not finite.
Validator = Callable[[Attribution], "Check"]


@dataclass(frozen=True)
class Check:
    """Evidence of the derivatives alone and of the whole explanation, and the gap, on flight not fitted."""

    base: Evidence
    final: Evidence
    gap: Gap  # of forces, moments and kinematics by frequency
    explanation: Attribution
    weather_suffices: bool = False  # whether weather and the sensors' noise account for the whole gap
    fitted: Check | None = None  # with fitted derivatives, where the explanation keeps the file's

    @property
    def models(self) -> tuple[ResidualModel, ...]:
        """The flights' residual models."""
        return tuple(flight.model for flight in self.base.flights)

    @cached_property
    def simulation_gap(self) -> Gap | None:
        """The gap of short simulated flights; none where none can be simulated."""
        return simulation_gap(self.base, self.final)

    @property
    def gaps(self) -> list[Gap]:
        """The gap by each measure: by frequency, then of short simulated flights where there are any."""
        return [self.gap, *([self.simulation_gap] if self.simulation_gap else [])]

    @property
    def attitude(self) -> dict[str, ErrorTable]:
        """The errors of the attitude by the gyroscopes, by channel."""
        return attitude_errors(self.gap.per_channel)

    @cached_property
    def corrected(self) -> Evidence:
        """The evidence of the whole explanation as the corrected file holds it."""
        return of_corrected_file(self.final, self.explanation.corrected)

    @cached_property
    def stated(self) -> tuple[Gap, Gap | None]:
        """The gap by frequency and that of short flights, as they are reported: ``after`` is the corrected file's.

        What the file's effects would close beyond that, were they moved within their tolerances, is in ``tolerances``.
        The causes were judged beside the file's derivatives where the explanation keeps these. What derivatives fitted
        within their tolerances would leave is stated nevertheless.
        """
        spectral, simulated = self.gap, self.simulation_gap
        if self.corrected is not self.final:
            spectral = self._gap_of(self.base, self.corrected)
            simulated = simulation_gap(self.base, self.corrected)
        if self.fitted is None:
            return spectral, simulated
        by_fitted = self.fitted.simulation_gap
        if simulated and by_fitted:
            simulated = spectral_error.within_tolerances(simulated, by_fitted)
        return spectral_error.within_tolerances(spectral, self.fitted.gap), simulated

    def as_in_file(self) -> Check:
        """The validation of the aircraft file as it is, on the same flights."""
        filed = (FlightEvidence.throughout(model, model.simulator.neutral()) for model in self.models)
        base = replace(self.base, flights=tuple(filed))
        return replace(self, base=base, final=base, gap=self._gap_of(base, base))

    def beside_file(self, fitted: Check) -> Check:
        """The validation of causes with the file's derivatives; ``fitted`` is that with the fitted ones."""
        filed = self.as_in_file()
        gap = spectral_error.gap_of(filed.base, self.final, self.explanation.structure_left)
        base = replace(filed.base, scores=self.base.scores)
        return replace(self, base=base, gap=gap, fitted=fitted)

    def _gap_of(self, base: Evidence, after: Evidence) -> Gap:
        """The gap by frequency of other evidence of the same flights."""
        return spectral_error.gap_of(base, after, self.explanation.structure_left)


def check(attribution: Attribution, held_out: Sequence[HeldOutFlight]) -> Check:
    """The validation of an explanation on flights held out; without these, by k-fold on the flights fitted."""
    if held_out:
        fits = liml_estimate(attribution.base.fit), attribution.corrected
        base, final = (held_out_evidence(fit, held_out) for fit in fits)
    else:
        base = kfold_evidence(attribution.base.evidence, liml_estimate(attribution.base.fit))
        final = kfold_evidence(
            attribution.chosen.evidence,
            attribution.corrected,
            filed=attribution.keeps_file_derivatives,
            held=attribution.held,
        )
    gap = spectral_error.gap_of(base, final, attribution.structure_left)
    return Check(base, final, gap, attribution)


def validate(
    attribution: Attribution, models: Sequence[ResidualModel], held_out: Sequence[HeldOutFlight]
) -> tuple[Attribution, Check]:
    """What of an explanation stands on flight not fitted, and its validation there.

    No cause stands where weather and the sensors' noise account for the whole gap, unless it takes away what weather
    cannot have caused. Without causes the file's own derivatives are kept where the fitted ones predict worse.
    ``models`` are the flights that were fitted.
    """
    validator = partial(check, held_out=held_out)
    with ThreadPoolExecutor(1) as pool:
        weather = pool.submit(weather_suffices, [*models, *(flight.model for flight in held_out)])
        attribution, checked = standing_explanation(attribution, validator)
    flown = checked.simulation_gap.per_channel if checked.simulation_gap else {}
    turned = {name: table._asdict() for name, table in checked.attitude.items()}
    taken = shares_taken_away({**flown, **turned})
    if weather.result() and not (attribution.causes and causes_exceed_weather(taken)):
        attribution = attribution.without_causes().as_in_file()
        of_file = validator(attribution).as_in_file()
        return attribution, replace(of_file, weather_suffices=True)
    if not attribution.causes and file_predicts_better(checked.gaps):
        attribution = attribution.as_in_file()
        checked = checked.as_in_file()
    return attribution, checked


def standing_explanation(attribution: Attribution, validator: Validator) -> tuple[Attribution, Check]:
    """The first explanation that stands, and its validation.

    In this order: all causes; the same with the sizes of least squares; without one of the causes, without two; no
    cause. Each is also tried with the file's own derivatives, and kept so where these predict better. An explanation
    whose predictions are not finite is passed over. What stands is left without the causes that are needless there,
    and its insignificant sizes are held at the file's values where that predicts no worse.

    A cause of which nothing significant is left beside the file's derivatives only made up for the fitted ones. Such an
    explanation is kept with the fitted derivatives, unless one with fewer causes predicts better.
    """
    fallback: tuple[Attribution, Check] | None = None
    for explanation in _explanations(attribution):
        try:
            fitted = explanation, validator(explanation)
            found = _with_better_derivatives(*fitted, validator)
            insignificant = _has_insignificant_cause(found[0])
        except np.linalg.LinAlgError:
            continue
        if insignificant:
            fallback = fallback or (fitted if _stands(*fitted) else None)
        elif _stands(*found) and (fallback is None or found[1].gaps[-1].after < fallback[1].gaps[-1].after):
            return _without_insignificant_sizes(*_without_needless_causes(*found, validator), validator)
    if fallback is not None:
        return _without_insignificant_sizes(*_without_needless_causes(*fallback, validator), validator)
    bare = attribution.without_causes()
    return bare, validator(bare)


def _stands(attribution: Attribution, checked: Check) -> bool:
    attitude = tuple(checked.attitude.values())
    return causes_stand(checked.gaps, attitude, derivatives_plausible=not attribution.is_favoured_by_derivatives)


def _without_needless_causes(
    attribution: Attribution, checked: Check, validator: Validator
) -> tuple[Attribution, Check]:
    """The explanation with the fewest causes that predicts at least as well by every measure, of these the best.

    At least as well as each larger one that does, too. Only where no derivative moves in a cause's place: where all are
    the file's, or are no farther from it without it.
    """
    filed, sizes = attribution.keeps_file_derivatives, attribution.sizes_of_file
    fewer = []
    for smaller in attribution.with_fewer_causes() if len(attribution.causes) > 1 else ():
        if not filed and smaller.has_less_plausible_derivatives_than(attribution):
            continue
        try:
            found = validator(smaller.with_file_derivatives(sizes=sizes) if filed else smaller)
            if is_needless(checked.gaps, found.gaps):
                whole = _with_better_derivatives(smaller, validator(smaller) if filed else found, validator)
                as_before = whole[0].keeps_file_derivatives or not filed
                fewer.extend(
                    [whole] if as_before and _stands(*whole) and not _has_insignificant_cause(whole[0]) else []
                )
        except np.linalg.LinAlgError:
            continue
    fewest = [each for each in fewer if all(is_needless(more.gaps, each[1].gaps) for more in _larger(each[0], fewer))]
    return min(fewest, key=lambda each: (len(each[0].causes), each[1].gaps[-1].after), default=(attribution, checked))


def _larger(attribution: Attribution, others: Sequence[tuple[Attribution, Check]]) -> list[Check]:
    """The validations of those of other explanations that have all causes of one, and more."""
    own = set(attribution.labels)
    return [checked for other, checked in others if own < set(other.labels)]


def _without_insignificant_sizes(
    attribution: Attribution, checked: Check, validator: Validator
) -> tuple[Attribution, Check]:
    """The causes with insignificant sizes at the file's values, where all measures are at least as good."""
    smaller = attribution.without_insignificant_sizes(scattered_errors)
    if smaller is None:
        return attribution, checked
    try:
        found = validator(smaller)
    except np.linalg.LinAlgError:
        return attribution, checked
    if not is_needless(checked.gaps, found.gaps):
        return attribution, checked
    gap = spectral_error.gap_of(checked.base, found.final, attribution.structure_left)
    return smaller, replace(found, base=checked.base, gap=gap, fitted=checked.fitted)


def _explanations(attribution: Attribution) -> Iterator[Attribution]:
    """An explanation, then those that may stand in its place."""
    if attribution.causes:
        yield attribution
        if attribution.corrected is not attribution.chosen.fit:
            yield attribution.by_least_squares()
    yield from attribution.with_fewer_causes()


def _with_better_derivatives(
    attribution: Attribution, checked: Check, validator: Validator
) -> tuple[Attribution, Check]:
    """The causes with the file's own derivatives, where these predict better than with the fitted ones.

    What an effect does that the derivatives cannot account for, they are bent to. Beside the effect they may be right;
    then its size is the one that belongs to them, which is taken where it predicts clearly better than that of the fit.
    """
    best = attribution, checked
    for sizes in (False, True):
        explanation = attribution.with_file_derivatives(sizes=sizes)
        try:
            found = validator(explanation)
        except np.linalg.LinAlgError:
            continue
        clearly = sizes or not file_predicts_better(checked.gaps)
        if file_derivatives_suit_causes(found.gaps, best[1].gaps, clearly=clearly):
            best = explanation, found
    return best if best[1] is checked else (best[0], best[1].beside_file(checked))


def _has_insignificant_cause(attribution: Attribution) -> bool:
    """Whether of some cause nothing significant is left beside the file's derivatives."""
    return attribution.keeps_file_derivatives and attribution.has_insignificant_cause(scattered_errors)
