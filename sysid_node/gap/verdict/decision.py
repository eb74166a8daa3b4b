"""The verdict, as a pure function of a table of scores and of the thresholds.

``verdict.measurement`` fills the table. The rules stand in the order in which they are applied; the first that holds
gives the verdict:

1. ``unsupported``: the flight hardly rises above the sensors' noise.
2. ``no_gap``: weather and the sensors' noise alone account for the simulator's error in every reading.
3. ``unsupported``: nothing but an autopilot that responds to gusts moves the control surfaces.
4. Without causes ``no_gap``, or ``unknown_effect`` where the remainder is structured, where a well supported effect is
   misspecified, or where the simulator's error needs a cause.
5. With causes ``unknown_effect``, where they close too little of the gap, predict no better than the derivatives,
   explain too small a share, or leave more structure on some channel than they remove there.
6. ``explained`` where every cause is told apart from its alternatives, else ``ambiguous``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds

#: Rules that leave an effect unknown although there are causes, in words.
OPEN = "the causes close too little of the gap"
NO_BETTER = "the causes predict no better than the derivatives within their tolerances"
SMALL_SHARE = "the causes explain too small a share of the gap"
STRUCTURED = "on some channel more structure is left than the causes remove"
RESEMBLING = "a well supported effect is misspecified"


@dataclass(frozen=True)
class CauseScores:
    """One cause of the explanation."""

    label: str
    share: float  # of the probability that it has together with its alternatives
    power_removed: Array  # (12,) that it removes on flight not fitted, the other causes given


@dataclass(frozen=True)
class RejectedCauseScores:
    """One effect that predicts better, but was not kept as a cause."""

    label: str
    supported_but_misspecified: bool  # well supported by its log Bayes factor, but its equation is misspecified
    replaced: bool = False  # an alternative took its place


@dataclass(frozen=True)
class SimulationScores:
    """Errors (rms) of short simulated flights as shares of the motion, on flight not fitted."""

    after: float
    noise_floor: float
    after_lower: float  # lower end of its 95 % interval
    noise_floor_upper: float  # upper end of its 95 % interval
    shrink_upper: float  # upper end of the shrinkage's 95 % interval, %


@dataclass(frozen=True)
class VerdictScores:
    """All that the verdict depends on. Powers and statistics are by channel (12,), on flight not fitted."""

    signal_to_noise: float  # largest power over the power of the sensors' noise, of all flights and channels
    weather_suffices: bool  # weather and the sensors' noise account for the simulator's error in every reading
    externally_excited: bool  # the commands of at least one flight are more than the autopilot's response to gusts
    causes: tuple[CauseScores, ...]
    rejected: tuple[RejectedCauseScores, ...]
    score_before: float  # log predictive score of the derivatives within their tolerances, nats
    score_after: float  # the same with the causes
    motion: Array  # power of what was measured, about the windows' means
    power_before: Array  # power left by the derivatives within their tolerances
    power_after: Array  # power left with the causes
    structure_deviations: Array  # test statistic of over-identification, standard deviations from its mean
    structure_share: Array  # share of the power left that is structure
    sampling: Array  # power that stamps leave that are off by chance within a sample, as a share of the motion, and
    # that a surrogate leaves of the simulator that it stands for
    simulation: SimulationScores | None  # none where no short flight can be simulated
    excited: Array = field(default_factory=lambda: np.ones(12))  # one where the commands excite the motion, else zero


@dataclass(frozen=True)
class Decision:
    """The verdict, the labels of the causes and of the rejected effects, and the rule that gave the verdict."""

    verdict: str
    causes: tuple[str, ...]
    rejected: tuple[str, ...]
    reason: str


def decide(scores: VerdictScores, thresholds: Thresholds = THRESHOLDS) -> Decision:
    """The verdict: one of ``no_gap``, ``explained``, ``ambiguous``, ``unknown_effect``, ``unsupported``."""
    verdict, reason = next(_rules(scores, thresholds))
    causes = tuple(cause.label for cause in scores.causes)
    return Decision(verdict, causes, tuple(cause.label for cause in scores.rejected), reason)


def _rules(scores: VerdictScores, thresholds: Thresholds) -> Iterator[tuple[str, str]]:
    """The verdicts of all rules that hold, with the rule in words, the first to be applied first."""
    if scores.signal_to_noise < thresholds.admission.excitation:
        yield "unsupported", "the flight hardly rises above the sensors' noise"
    if scores.weather_suffices:
        yield "no_gap", "weather and the sensors' noise account for the simulator's error"
    if not scores.externally_excited:
        yield "unsupported", "only an autopilot that responds to gusts moves the control surfaces"
    yield from _rules_with_causes(scores, thresholds) if scores.causes else _rules_without(scores, thresholds)


def _rules_without(scores: VerdictScores, thresholds: Thresholds) -> Iterator[tuple[str, str]]:
    """Rules where no cause was kept."""
    if structured_channels(scores, thresholds).any():
        yield "unknown_effect", "the remainder is structured, and no effect explains it"
    if is_misspecified(scores):
        yield "unknown_effect", RESEMBLING
    if error_needs_cause(scores.simulation, thresholds):
        yield "unknown_effect", "the simulator's error is larger than noise and weather make it"
    yield "no_gap", "nothing that matters is left to explain"


def _rules_with_causes(scores: VerdictScores, thresholds: Thresholds) -> Iterator[tuple[str, str]]:
    """Rules where at least one cause was kept."""
    if closes_too_little(scores.simulation, thresholds):
        yield "unknown_effect", OPEN
    if scores.score_after <= scores.score_before:
        yield "unknown_effect", NO_BETTER
    if explained_share(scores, thresholds) < thresholds.verdict.explained:
        yield "unknown_effect", SMALL_SHARE
    if structure_exceeds_causes(scores, thresholds):
        yield "unknown_effect", STRUCTURED
    if is_misspecified(scores):
        yield "unknown_effect", RESEMBLING
    if all(cause.share >= thresholds.verdict.told_apart for cause in scores.causes):
        yield "explained", "every cause is told apart from its alternatives"
    yield "ambiguous", "an alternative would do nearly as well as a cause"


def structured_channels(scores: VerdictScores, thresholds: Thresholds = THRESHOLDS) -> NDArray[np.bool_]:
    """Channels (12,) on which structure is left that is significant and large enough to matter."""
    least = thresholds.acceptance.noticeable_error**2 + scores.sampling
    significant = scores.structure_deviations > thresholds.verdict.structure
    return np.asarray(significant & (structure_left(scores, thresholds) > least))


def structure_left(scores: VerdictScores, thresholds: Thresholds = THRESHOLDS) -> Array:
    """Power (12,) of what is left and is structure beyond chance, as a share of the motion, where this is excited."""
    beyond_chance = scores.structure_deviations > thresholds.instruments.chance
    share = np.where(beyond_chance, scores.structure_share, 0.0) * scores.excited
    return np.asarray(share * scores.power_after / scores.motion)


def is_misspecified(scores: VerdictScores) -> bool:
    """Whether a well supported effect is misspecified and no alternative took its place.

    Then something is there that resembles the effect, but is not the effect.
    """
    return any(cause.supported_but_misspecified and not cause.replaced for cause in scores.rejected)


def error_needs_cause(simulation: SimulationScores | None, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether the simulator's error is surely larger than noise and weather make it, by its size or by its share."""
    if simulation is None:
        return False
    beyond_noise = simulation.after_lower**2 - simulation.noise_floor_upper**2
    return beyond_noise > thresholds.verdict.error**2 or closes_too_little(simulation, thresholds)


def closes_too_little(simulation: SimulationScores | None, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether the shrinkage of the gap is surely incomplete, and the error more than chance leaves above the floor."""
    if simulation is None:
        return False
    above_floor = simulation.after > thresholds.validation.chance * simulation.noise_floor
    return above_floor and simulation.shrink_upper < thresholds.verdict.closed


def structure_exceeds_causes(scores: VerdictScores, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether on some channel structure is left that matters, and more of it than all causes remove there."""
    removed = sum(cause.power_removed for cause in scores.causes) / scores.motion
    return bool(np.any(structured_channels(scores, thresholds) & (structure_left(scores, thresholds) > removed)))


def explained_share(scores: VerdictScores, thresholds: Thresholds = THRESHOLDS) -> float:
    """Share that the causes remove of what derivatives leave and is not noise, all channels together; 1 of nothing."""
    removed = max(float(((scores.power_before - scores.power_after) / scores.motion * scores.excited).sum()), 0.0)
    whole = removed + float(structure_left(scores, thresholds).sum())
    return removed / whole if whole > 0.0 else 1.0


def unexplained_share(scores: VerdictScores, thresholds: Thresholds = THRESHOLDS) -> float:
    """Share that no cause explains; zero where nothing structured is left and no supported effect is misspecified."""
    if structured_channels(scores, thresholds).any() or is_misspecified(scores):
        return 1.0 - explained_share(scores, thresholds)
    return 0.0
