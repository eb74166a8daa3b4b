"""Whether a candidate is accepted into an explanation, as a pure function of a table of scores.

A significant effect is not enough: a delay of a millisecond may be beyond doubt and of no interest. An effect is
accepted where all of these hold:

1. it is not a time within one sample of the slowest topic, which is a matter of sampling, no free play in which the
   surface does not move at all, and not larger than real parts show;
2. with it the explanation predicts flight that was not fitted better, beyond doubt; a bias beyond what the file states
   of it, which fitted derivatives can stand in for, need only predict no worse;
3. it matters by one of these: on some channel of forces, moments and kinematics it removes a share of the remainder,
   and a share of the whole gap comes back without it; it removes such a share of the error of some reading of short
   simulated flights, in which what an instrument does adds up; the derivatives are much more probable together with it,
   by the file's tolerances; or it is a bias beyond what the file states of it;
4. its log Bayes factor, from what the commands predict, makes up for its having been picked from many effects. Gusts
   can imitate the first three, and a model that is not exact repeats its error with every manoeuvre.

``selection.comparison`` measures the table.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.residuals.residual_model import CHANNELS, COEFFICIENTS
from sysid_node.gap.thresholds import THRESHOLDS, Acceptance, Thresholds


@dataclass(frozen=True)
class RemainingPower:
    """Power (12,) by channel that is left without and with a candidate."""

    without: Array
    with_it: Array

    @property
    def removed(self) -> Array:
        """Power (12,) that the candidate removes."""
        return self.without - self.with_it

    @property
    def share_removed(self) -> Array:
        """Share (12,) of the power that the candidate removes; zero where there is none."""
        return np.divide(self.removed, self.without, out=np.zeros_like(self.without), where=self.without > 0.0)


@dataclass(frozen=True)
class RemainingStructure:
    """What of the power (12,) left without and with a candidate is structure, in noise levels."""

    coherent: RemainingPower
    total: Array  # all power that is left without it


@dataclass(frozen=True)
class DerivativeShift:
    """How far all derivatives together are from the aircraft file."""

    distance: float  # sum of the squared deviations, each in the standard deviation of its prior
    expected: float  # of that sum, if the priors are right
    log_widening: float = 0.0  # nats by which the prior is less dense where a candidate widens it

    @property
    def deviations(self) -> float:
        """Standard deviations by which the distance exceeds its expectation (chi-squared)."""
        return (self.distance - self.expected) / float(np.sqrt(2.0 * max(self.expected, 1.0)))


@dataclass(frozen=True)
class AddedSize:
    """How large what the candidate adds is."""

    time: float | None  # s, where it is an effect of one time; else none
    sample_period: float  # s, of the slowest topic
    largest: float = 0.0  # of its sizes beyond its standard error, in multiples of what real parts show
    bias: float = 0.0  # the largest that was added beyond its standard error, in 1 sigma that the file states, else 0
    play: float = 0.0  # least share of a control's travel that a free play takes, where it is one
    by_clock: float = 0.0  # s, by which the offset of the commands' clock delays the response beside it
    gradual: bool = False  # whether it is a flow separation that does not set in at any angle of attack


@dataclass(frozen=True)
class ScoresInGusts:
    """What tells of an effect in gusts, where most of the power that is left is weather. By channel (12,)."""

    structure: RemainingStructure  # of the flights fitted
    mean_power: RemainingPower  # of the means of what is left, which gusts do not change


@dataclass(frozen=True)
class ChannelScores:
    """Powers by channel (12,) of forces, moments and kinematics."""

    motion: Array  # of what was measured, about the windows' means
    power: RemainingPower  # on flight not fitted, all flights together
    contribution: Array  # what comes back without the candidate, the others held, as a share of what nuisances leave
    by_flight: tuple[tuple[Array, RemainingPower], ...] = ()  # of each of several flights: motion, and power left
    in_gusts: ScoresInGusts | None = None  # none where no flight is one in gusts
    #: Error of the simulator's model, as a share of the motion; zero where the simulator itself is known.
    simulator_error: Array = field(default_factory=lambda: np.zeros(len(CHANNELS)))


@dataclass(frozen=True)
class ReadingScores:
    """Mean squares (11,) by reading of short simulated flights, on flight not fitted if there is."""

    errors: RemainingPower
    motion: Array  # as measured; infinite where a reading is not compared
    simulator_error: Array  # errors of the simulator's model, as shares of the motion


class ComparisonScores(Protocol):
    """An explanation with a candidate, compared with the explanation without it."""

    @property
    def added(self) -> AddedSize:
        """Size of what the candidate adds."""

    @property
    def probability(self) -> float:
        """That flight not fitted is better predicted with the candidate than without it."""

    @property
    def channels(self) -> ChannelScores:
        """What it removes by channel."""

    @property
    def shifts(self) -> tuple[DerivativeShift, DerivativeShift]:
        """Of all derivatives together from the file: without and with the candidate."""

    @property
    def readings(self) -> ReadingScores:
        """What it removes of the errors of short flights."""

    @property
    def log_bayes_factor(self) -> float:
        """Of the explanation with the candidate against the one without, from what the commands predict, nats."""

    @property
    def searched(self) -> int:
        """Number of effects that the candidate was picked from."""


def _no_readings() -> ReadingScores:
    """Nothing known of short flights."""
    return ReadingScores(RemainingPower(np.zeros(1), np.zeros(1)), np.full(1, np.inf), np.zeros(1))


@dataclass(frozen=True)
class ComparisonTable:
    """The scores of one comparison as plain values: recorded, or made by hand."""

    added: AddedSize
    probability: float
    channels: ChannelScores
    log_bayes_factor: float
    searched: int
    shifts: tuple[DerivativeShift, DerivativeShift] = (DerivativeShift(0.0, 0.0), DerivativeShift(0.0, 0.0))
    readings: ReadingScores = field(default_factory=_no_readings)


def is_accepted(scores: ComparisonScores, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether the candidate is accepted."""
    return rejection(scores, thresholds) is None


def rejection(scores: ComparisonScores, thresholds: Thresholds = THRESHOLDS) -> str | None:
    """The first rule that the candidate fails, in words; none where it is accepted.

    Scores are read in the order of the rules, so that those of later rules need not be measured.
    """
    limits = thresholds.acceptance
    implausible = _implausibility(scores, thresholds)
    if implausible is not None:
        return implausible
    if not _predicts_well_enough(scores, thresholds):
        return "it does not predict better beyond doubt"
    if not _is_large(scores, limits):
        return "it removes too little"
    if not scores.log_bayes_factor > limits.log_bayes_factor(scores.searched):
        return "what the commands predict does not support it"
    return None


def is_relevant(scores: ComparisonScores, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether a candidate explains what matters (rules 1 and 3), however probable it is.

    What is within one sample, larger than in real parts, or too small to be of interest explains something else than a
    cause does, and is no alternative to it. Beside a lag the offset of the commands' clock may explain a sample of the
    response's delay; the lag itself is the rest. Both together are what a delay of the commands explains alone.
    """
    return is_plausible(scores, thresholds) and _is_large(scores, thresholds.acceptance)


def is_plausible(scores: ComparisonScores, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether a cause passes rule 1 as it stands in the whole explanation, where its size may be another than alone."""
    return _implausibility(scores, thresholds, together=True) is None


def _implausibility(scores: ComparisonScores, thresholds: Thresholds, *, together: bool = False) -> str | None:
    """What of rule 1 the candidate fails, in words; none where it passes.

    ``together`` counts what the clock's offset explains beside it.
    """
    added = scores.added
    more = added.by_clock if together else 0.0
    if added.time is not None and abs(added.time) + more < added.sample_period:
        return "its time is within one sample"
    if added.play > thresholds.priors.jammed:
        return "with so much free play the surface does not move: it is stuck"
    if added.gradual:
        return "the flow separates gradually at all angles of attack: it is no stall"
    return "no real part is off so far" if added.largest > thresholds.acceptance.plausible else None


def _predicts_well_enough(scores: ComparisonScores, thresholds: Thresholds) -> bool:
    """Whether the candidate passes rule 2.

    A constant error of an instrument is a constant in the coefficients, and derivatives within their tolerances can be
    bent to that as well. That they need not be is seen by the log Bayes factor, in which their priors are.
    """
    if predicts_better(scores.probability, thresholds):
        return True
    return scores.probability >= 0.5 and scores.added.bias > thresholds.acceptance.bias


def predicts_better(probability: float, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether a probability that one explanation predicts better than another is beyond doubt."""
    return probability > thresholds.acceptance.probability


def _is_large(scores: ComparisonScores, limits: Acceptance) -> bool:
    """Whether the candidate matters by any of the measures of rule 3, the cheapest first."""
    channels = scores.channels
    if np.any(channels_improved(channels, limits) & (channels.contribution > limits.share_of_gap)):
        return True
    if is_favoured_by_derivatives(scores.shifts, scores.searched, limits) or scores.added.bias > limits.bias:
        return True
    return bool(readings_improved(scores.readings, limits).any())


def is_favoured_by_derivatives(
    shifts: tuple[DerivativeShift, DerivativeShift], searched: int, limits: Acceptance = THRESHOLDS.acceptance
) -> bool:
    """Whether the derivatives' joint prior favours the candidate beyond doubt, and they are plausible with it.

    A mass that is a fifth off moves each coefficient by two tolerances. Each alone is plausible, together they are not:
    so many independent draws are less probable than one common cause. The logarithm of the ratio of the two joint prior
    densities is half the difference of the squared distances, each beyond its expectation, less what the density loses
    where the candidate is a gross error of derivatives and their priors are wider.
    """
    return nats_by_tolerances(shifts, limits) > limits.log_bayes_factor(searched)


def nats_by_tolerances(
    shifts: tuple[DerivativeShift, DerivativeShift], limits: Acceptance = THRESHOLDS.acceptance
) -> float:
    """Nats by which the derivatives' joint prior favours the candidate; zero where they are not plausible with it."""
    without, with_it = (0.5 * (shift.distance - shift.expected) + shift.log_widening for shift in shifts)
    return without - with_it if shifts[1].deviations < limits.joint else 0.0


def readings_improved(scores: ReadingScores, limits: Acceptance = THRESHOLDS.acceptance) -> NDArray[np.bool_]:
    """Readings (11,) of short flights on which the candidate removes enough of the error to matter.

    What an instrument does is small in forces and moments, and in what an observer predicts that follows the readings.
    In a flight of some seconds from a state that was read wrongly it adds up.
    """
    least = np.sqrt(limits.noticeable_error**2 + scores.simulator_error**2)
    return _matters(scores.errors, 1.0, scores.motion, least, limits)


def channels_improved(scores: ChannelScores, limits: Acceptance = THRESHOLDS.acceptance) -> NDArray[np.bool_]:
    """Channels (12,) on which the candidate removes enough of the remainder to matter.

    In one flight is enough: another may show what no effect describes, and more of it than all that this one holds. In
    gusts most of what is left of forces and moments is weather; there what of it is structure counts, and the mean.
    """
    least = np.sqrt(limits.noticeable_error**2 + scores.simulator_error**2)
    large = np.maximum(limits.large_error, scores.simulator_error)
    motion, enough = scores.motion, np.zeros(len(CHANNELS), bool)
    for moved, power in ((motion, scores.power), *scores.by_flight):
        enough |= _matters(power, 1.0, moved, least, limits) | (power.removed > large**2 * moved)
    if scores.in_gusts is None:
        return np.asarray(enough)
    structure = scores.in_gusts.structure
    scale = scores.power.without / np.maximum(structure.total, 1e-300)  # of noise levels to power
    of_forces = _matters(structure.coherent, scale, motion, least, limits)
    of_forces |= _matters(scores.in_gusts.mean_power, 1.0, motion, least, limits)
    return np.where(np.arange(len(CHANNELS)) < len(COEFFICIENTS), of_forces, enough)


def _matters(
    power: RemainingPower, scale: Array | float, motion: Array, least: Array, limits: Acceptance
) -> NDArray[np.bool_]:
    """Channels (12,) on which enough of a power is removed: as a share of itself, and of the motion.

    ``least`` (12,) is the smallest error that counts, as a share of the motion.
    """
    share = power.removed > limits.share_of_remainder * power.without
    return np.asarray(share & (power.removed * scale > least**2 * motion))
