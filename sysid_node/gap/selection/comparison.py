"""Explanations compared: the scores of a fitted set of candidates against one that lacks some of them.

Every score is computed when it is first read, because the later ones are costly and seldom needed
(``selection.acceptance``).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, with_candidates
from sysid_node.gap.estimation.candidates import RESPONSE_DELAYS, TIME_EFFECTS, travel_of
from sysid_node.gap.estimation.nuisances import stated_biases
from sysid_node.gap.estimation.predictive_density import Evidence, FlightEvidence, exported_parameters, probabilities
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.instruments.bayes_factor import log_bayes_factor
from sysid_node.gap.instruments.overidentification import overidentification_of
from sysid_node.gap.residuals.air_motion import is_gusty
from sysid_node.gap.residuals.excited_axes import excited_channels
from sysid_node.gap.residuals.parameter_priors import bounds
from sysid_node.gap.residuals.residual_model import CHANNELS, COEFFICIENTS
from sysid_node.gap.residuals.windowed_spectra import power_of
from sysid_node.gap.selection.acceptance import (
    AddedSize,
    ChannelScores,
    ComparisonTable,
    DerivativeShift,
    ReadingScores,
    RemainingPower,
    RemainingStructure,
    ScoresInGusts,
)
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.gap.short_flights.readings import READINGS, reading_errors, reading_motion
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import EFFECTS
from sysid_node.sim.model.parameters import stated_parameters

_FREE_PLAY = "actuator_backlash"

#: The offset of the commands' clock; positive where their stamps are late.
_COMMANDS_CLOCK = "actuator_stamp_delay.delay"


@dataclass(frozen=True)
class Comparison:
    """A fitted set against one without some of its candidates; ``base`` has nuisances only.

    Its attributes are those of ``acceptance.ComparisonScores``.
    """

    base: FittedSet
    without: FittedSet
    fitted: FittedSet

    @cached_property
    def added(self) -> AddedSize:
        """Size of what was added."""
        fitted, models = self.fitted, self.fitted.fit.models
        period = max(max(model.flight.step_interval, 1.0 / model.flight.air_rate) for model in models)
        return AddedSize(
            _time(fitted), period, _largest_size(fitted), _largest_bias(fitted), _play(fitted), _by_clock(fitted),
            _is_gradual(fitted),
        )  # fmt: skip

    @cached_property
    def probability(self) -> float:
        """That flight not fitted is better predicted with what was added."""
        return probability_against(self.fitted, self.without)

    @cached_property
    def channels(self) -> ChannelScores:
        """What was removed by channel."""
        without, fitted, models = self.without, self.fitted, self.fitted.fit.models
        motions = _motion_by_flight(fitted)
        return ChannelScores(
            motion=np.asarray(sum(motions)),
            power=_power(without, fitted),
            contribution=_contribution(self.base, without, fitted),
            by_flight=_by_flight(without, fitted, motions),
            in_gusts=scores_in_gusts(without, fitted) if any(is_gusty(model) for model in models) else None,
            simulator_error=np.asarray(np.max([model.simulator_error for model in models], axis=0)),
        )

    @cached_property
    def shifts(self) -> tuple[DerivativeShift, DerivativeShift]:
        """How far all derivatives together are from the file without and with what was added."""
        return derivative_shift(self.without.fit), derivative_shift(self.fitted.fit)

    @cached_property
    def readings(self) -> ReadingScores:
        """The errors of short flights: on flights held out, without these on those fitted."""
        known = [model.reading_errors for model in self.fitted.fit.models]
        return ReadingScores(
            errors=RemainingPower(*(reading_errors(_flown(each)) for each in (self.without, self.fitted))),
            motion=reading_motion([flight.model for flight in _flown(self.fitted)]),
            simulator_error=np.array([max(errors.get(name, 0.0) for errors in known) for name in READINGS]),
        )

    @cached_property
    def log_bayes_factor(self) -> float:
        """From what the commands predict, nats."""
        return log_bayes_factor(self.fitted.fit, self.without.fit)

    @property
    def searched(self) -> int:
        """Number of effects."""
        return len(EFFECTS)

    def table(self) -> ComparisonTable:
        """All scores as plain values."""
        return ComparisonTable(**{entry.name: getattr(self, entry.name) for entry in fields(ComparisonTable)})


def _time(fitted: FittedSet) -> float | None:
    """Size of what was added, s, where it is an effect of one time."""
    added = fitted.added
    if added is None or added.effect not in TIME_EFFECTS:
        return None
    entries = list(added.indices)
    changes = fitted.fit.flights[0].point[entries] - fitted.fit.simulator.neutral()[entries]
    return float(changes[np.abs(changes).argmax()])


def _by_clock(fitted: FittedSet) -> float:
    """Time, s, by which the offset of the commands' clock delays the response beside what was added; 0 if it does not.

    The clock is known to one sample. It may take up to a sample of a servo's lag.
    """
    added = fitted.added
    if added is None or added.effect not in RESPONSE_DELAYS:
        return 0.0
    place = fitted.fit.simulator.names.index(_COMMANDS_CLOCK)
    return max(0.0, float(fitted.fit.simulator.neutral()[place] - fitted.fit.flights[0].point[place]))


def _play(fitted: FittedSet) -> float:
    """Share of its control's travel that a free play takes, of several controls the least; zero of another effect."""
    added = fitted.added
    if added is None or added.effect != _FREE_PLAY:
        return 0.0
    simulator, point = fitted.fit.simulator, fitted.fit.flights[0].point
    travel = dict(zip(simulator.layout.controls, 2.0 * travel_of(fitted.fit.models), strict=True))
    widths = {name: each.value(point) for name, each in stated_parameters(simulator.layout, _FREE_PLAY).items()}
    return min((w / travel[name] for name, w in widths.items() if w > 0.0 and travel.get(name)), default=0.0)


def _is_gradual(fitted: FittedSet) -> bool:
    """Whether a flow separation was added that begins at the smallest angle, or as gradually, as the range allows.

    Less lift at all angles of attack is another slope of the lift.
    """
    fit, added = fitted.fit, fitted.added
    if added is None or added.effect != "stall_separation":
        return False
    shape = [i for i in added.indices if fit.simulator.parameters[i][1].name in ("alpha_star", "a1")]
    return bool((fit.flights[0].point[shape] <= bounds(fit.simulator, shape)[0] * (1.0 + 1e-6)).any())


def _largest_size(fitted: FittedSet) -> float:
    """Largest size of what was added beyond its standard error, in multiples of what real parts show."""
    fit, added = fitted.fit, fitted.added
    if added is None or fit.information is None:
        return 0.0
    sizes = [i for i in added.indices if fit.simulator.parameters[i][1].switch]
    errors = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))[[fit.indices.index(i) for i in sizes]]
    changes = np.abs(fit.flights[0].point[sizes] - fit.simulator.neutral()[sizes])
    return float(np.max((changes - 2.0 * errors) / fit.simulator.scales[sizes], initial=0.0))


def _largest_bias(fitted: FittedSet) -> float:
    """Largest bias that was added beyond its standard error, in 1 sigma that the file states.

    Zero for what is no bias, and where the file does not state what stays constant in a flight.
    """
    fit, added = fitted.fit, fitted.added
    if added is None or fit.information is None:
        return 0.0
    stated = stated_biases(fit.simulator.aircraft)
    names = {i: fit.simulator.names[i] for i in added.indices}
    known = [(i, stated[name]) for i, name in names.items() if stated.get(name)]
    return max((_beyond_error(fit, i) / sigma for i, sigma in known), default=0.0)


def _beyond_error(fit: CandidateFit, index: int) -> float:
    """By how much a value that was added differs from the file's beyond two standard errors."""
    place = fit.indices.index(index)
    change = fit.flights[0].point[index] - fit.simulator.neutral()[index]
    return float(abs(change) - 2.0 * np.sqrt(max(fit.covariance[place, place], 0.0)))


def _motion_by_flight(fitted: FittedSet) -> list[Array]:
    """Power (12,) of what was measured in each flight, about the windows' means.

    Infinite for the coefficients of a motion that no command excites, so that nothing there matters.
    """
    models = [flight.model for flight in fitted.evidence.flights]
    quiet = ~excited_channels(models) & (np.arange(len(CHANNELS)) < len(COEFFICIENTS))
    return [np.where(quiet, np.inf, (np.abs(m.measured[:, 1:]) ** 2).sum(axis=(0, 1))) for m in models]


def _power(without: FittedSet, fitted: FittedSet) -> RemainingPower:
    """Power left on flight not fitted; of a flight too short to be divided, by channel, what more is removed of.

    Half a manoeuvre may not determine what predicts the other half. That is seen by the predictive density, which
    knows how uncertain it is, but not by the power of the prediction's error. What the fits leave counts as well.
    """
    predicted = RemainingPower(power_left(without.evidence), power_left(fitted.evidence))
    if fitted.evidence.scores.size >= THRESHOLDS.evidence.fewest:
        return predicted
    fits = RemainingPower(_powers(without.fit)[0], _powers(fitted.fit)[0])
    more = fits.share_removed > predicted.share_removed
    return RemainingPower(
        np.where(more, fits.without, predicted.without), np.where(more, fits.with_it, predicted.with_it)
    )


def _by_flight(without: FittedSet, fitted: FittedSet, motions: list[Array]) -> tuple[tuple[Array, RemainingPower], ...]:
    """The motion's power, and the power left, of each flight where there are several."""
    pairs = zip(without.evidence.flights, fitted.evidence.flights, strict=True)
    powers = [RemainingPower(power_of(before.residual), power_of(after.residual)) for before, after in pairs]
    return tuple(zip(motions, powers, strict=True)) if len(powers) > 1 else ()


def scores_in_gusts(without: FittedSet, fitted: FittedSet) -> ScoresInGusts:
    """What of the power is structure, in the noise that the larger set leaves, and what is off on average."""
    before = overidentification_of(without.fit, fitted.fit.powers)
    after = overidentification_of(fitted.fit)
    return ScoresInGusts(
        RemainingStructure(RemainingPower(before.coherent, after.coherent), before.total),
        RemainingPower(_power_of_means(without.evidence), _power_of_means(fitted.evidence)),
    )


def _contribution(base: FittedSet, without: FittedSet, fitted: FittedSet) -> Array:
    """Power (12,) that comes back without what was added, as a share of what nuisances alone leave.

    The other candidates are held, and nuisances are fitted: free, the others would fit what is gone (a lag twice as
    long for an engine half as strong). Infinite where nothing finite can be predicted without what was added.
    """
    fit = fitted.fit
    kept = [c for c in fit.candidates if c.effect in without.fit.effects]
    lacking = with_candidates(fit, kept, base.fit.nuisances, ()).with_powers(without.fit.powers)
    try:
        lacking = lacking.at(VariableProjection(lacking).points(lacking.values))
    except np.linalg.LinAlgError:
        return np.full(len(CHANNELS), np.inf)
    left, now, whole = (_powers(each) for each in (lacking, fit, base.fit))
    return np.asarray(np.max((left - now) / np.maximum(whole, 1e-300), axis=0))


def derivative_shift(fit: CandidateFit) -> DerivativeShift:
    """How far the derivatives are from the file, in the standard deviations of their priors.

    Of a derivative that the flights determine the expectation of its square is one, of another the share of its prior's
    variance that they take away (the prior predictive check of Box (1980), J. R. Stat. Soc. A 143(4), for parameters).
    """
    assert fit.information is not None
    now, spread, _ = fit.stacked
    places = fit.derivative_places
    variance = np.diag(fit.covariance)[len(fit.indices) :][places]
    known = np.clip(1.0 - variance / spread[places] ** 2, 0.0, 1.0)
    return DerivativeShift(float(np.sum((now[places] / spread[places]) ** 2)), float(known.sum()), fit.log_widening)


def _flown(fitted: FittedSet) -> list[FlightEvidence]:
    """Flights on which short flights are simulated: those held out, else those fitted, each with one set of parameters.

    The size of an effect is asked for here, not whether it is there. Therefore parts of the fitted flights need not be
    predicted from the others, which would take as many simulations.
    """
    fit = fitted.fit
    held_out = fitted.evidence.flights[len(fit.flights) :]
    own = (FlightEvidence.throughout(f.model, exported_parameters(fit, f.point)) for f in fit.flights)
    return list(held_out or own)


def probability_against(fitted: FittedSet, other: FittedSet) -> float:
    """That one fitted set predicts flight not fitted better than another."""
    return float(probabilities([fitted.evidence.scores, other.evidence.scores])[0])


def power_left(evidence: Evidence) -> Array:
    """Power (12,) of what is left on flight not fitted."""
    return np.asarray(sum(power_of(flight.residual) for flight in evidence.flights))


def _power_of_means(evidence: Evidence) -> Array:
    """Power (12,) of the flights' means of what is left, counted as ``windowed_spectra.power_of`` counts it."""
    means = (0.5 * len(r) * np.abs(r[:, 0].mean(axis=0)) ** 2 for r in (flight.residual for flight in evidence.flights))
    return np.asarray(sum(means))


def _powers(fit: CandidateFit) -> Array:
    """Power (2, 12) of a fit's residuals: with the means, and without them.

    Beside a large mean the rest may be small.
    """
    residuals = [flight.residual for flight in fit.flights]
    about_means = [np.concatenate([0.0 * r[:, :1], r[:, 1:]], axis=1) for r in residuals]
    return np.array([sum(power_of(r) for r in each) for each in (residuals, about_means)])
