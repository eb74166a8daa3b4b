"""Thresholds and tuned constants of the gap that decide something, each with its unit, meaning and source.

``THRESHOLDS`` holds the values in use. Decision functions take a ``Thresholds`` as their last argument, so that
``bench/gap/thresholds.py`` can decide again from recorded scores with other values. ``table`` lists all of them.

A source is a bench that learned the value from flights of known truth, a definition, or "chosen": a judgement that no
bench learned. Settings of numerical methods (rounds, tolerances, ridges, starting values) are no thresholds and stand
where they are used.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import Field, dataclass, field, fields
from math import log
from typing import Any, NamedTuple

from sysid_node.flight.live.mean_lift import LARGEST_RATIO, STALL_ANGLE

_CHOSEN = "chosen"


def _threshold(value: object, unit: str, meaning: str, source: str = _CHOSEN) -> Any:
    """A dataclass field with a default value and what is to be known about it."""
    return field(default=value, metadata={"unit": unit, "meaning": meaning, "source": source})


@dataclass(frozen=True)
class Admission:
    """Which flights can be diagnosed."""

    least_travel: float = _threshold(0.004, "rad", "travel below which a control surface counts as not moved")
    lift_ratio: float = _threshold(
        LARGEST_RATIO,
        "1",
        "ratio of measured to expected mean lift, or its inverse, from which a flight is another aircraft's",
    )
    vane_error: float = _threshold(0.1, "rad", "error of the vane that may account for a wrong mean lift")
    stall_angle: float = _threshold(STALL_ANGLE, "rad", "mean angle of attack from which a loss of lift may be a stall")
    excitation: float = _threshold(
        6.0, "1", "power over the power of the sensors' noise below which a flight supports no verdict"
    )
    share_of_command: float = _threshold(
        0.05, "1", "angular acceleration that is commanded, as a share of the largest, from which a motion is excited"
    )
    thrust: float = _threshold(0.3, "m/s^2", "acceleration by the thrust (rms) from which it excites the motion")


@dataclass(frozen=True)
class ManoeuvreWindow:
    """When a flight is cut down to its only manoeuvre."""

    before: float = _threshold(2.0, "s", "time before the first step that belongs to the manoeuvre: trim")
    after: float = _threshold(5.0, "s", "time after the last step that belongs to it: the modes that it excited")
    share_of_changes: float = _threshold(0.95, "1", "share of the commands' sudden changes that a manoeuvre holds")
    share_of_flight: float = _threshold(0.4, "1", "share of the flight below which the flight is cut down to it")
    sudden: float = _threshold(8.0, "1", "multiple of a command's median change from which a change is sudden")
    elsewhere: float = _threshold(
        2.0, "1", "power of a control in what is cut off, over that in the manoeuvre, up to which this is done"
    )


@dataclass(frozen=True)
class Priors:
    """Prior distributions of nuisance parameters and of candidates' parameters."""

    limit: float = _threshold(
        3.0, "1 sigma", "most that a nuisance may be off: 99.7 % of normally distributed errors lie within"
    )
    widening: float = _threshold(
        5.0, "1", "factor on the tolerances of one coefficient's derivatives where these are the candidate"
    )
    ideal: float = _threshold(
        0.02,
        "1",
        "1 sigma of a derivative of a simulator's file (ideal: true) that states none, as a share of its size: "
        "tables of an imported model are right within about a hundredth",
    )
    reality: float = _threshold(
        0.1,
        "1",
        "1 sigma of what a real derivative may be off such a file's, as a share of its size, from which the prior is "
        "widened where the derivatives of a coefficient are the candidate",
    )
    scale: float = _threshold(3.0, "1", "1 sigma of a candidate's parameter, as a multiple of its plausible scale")
    inferred_angle: float = _threshold(0.01, "rad", "1 sigma of the mean error of a flow angle that no vane measured")
    gusty: float = _threshold(
        0.005, "1", "motion of the air (rms), as a share of the airspeed, from which a flight is one in gusts"
    )
    rotation: float = _threshold(
        0.5, "1", "1 sigma of the rotation that the aircraft feels in gusts, as a share of that which the vanes show"
    )
    jammed: float = _threshold(0.95, "1", "least share of its movement that a stuck surface has lost")
    lowest_mode: float = _threshold(
        3.0,
        "Hz",
        "lowest frequency of a structural mode: a slower one fits the response to gusts (docs/research/gap.md)",
    )


@dataclass(frozen=True)
class Instruments:
    """Instrumental variables, and the test of the restrictions that they impose."""

    memory: float = _threshold(3.0, "s", "time constant with which a step in a command is forgotten")
    stepped: float = _threshold(0.3, "1", "share of a command's movement that must be steps for them to stand for it")
    driven: float = _threshold(
        0.5, "1", "share of the surfaces' movement, predicted from the air's motion, from which the weather moves them"
    )
    lags: tuple[float, ...] = _threshold((0.0, 0.06, 0.2, 0.6), "s", "time constants of the lags on the commands")
    resonances: tuple[float, ...] = _threshold(
        (0.6, 0.9, 1.35, 2.0, 3.0), "Hz", "frequencies of the resonators on the commands (Kautz functions)"
    )
    damping: float = _threshold(0.2, "1", "damping ratio of the resonators: neighbours' bands meet")
    chance: float = _threshold(
        4.0, "1 sigma", "deviation of the test statistic from its mean below which coherence is chance"
    )


@dataclass(frozen=True)
class PredictiveEvidence:
    """Predictive scores, and the probabilities of explanations that follow."""

    groups: int = _threshold(8, "1", "groups of neighbouring windows that a flight is divided into, at most")
    fewest: int = _threshold(3, "1", "groups below which the power that the fits leave counts, too")
    excited: float = _threshold(
        0.75,
        "1",
        "share of the groups that the commands excite (effective number) below which flights cannot be divided: 0.4 to "
        "0.6 where there is one manoeuvre, 0.9 and more where each is repeated",
    )
    draws: int = _threshold(2000, "1", "draws of the Bayesian bootstrap over the groups")


@dataclass(frozen=True)
class Acceptance:
    """Which candidates are accepted into an explanation."""

    probability: float = _threshold(0.95, "1", "probability, against doing without, above which an effect is accepted")
    share_of_remainder: float = _threshold(
        0.25, "1", "share of the remaining power of a channel that an effect must remove"
    )
    share_of_gap: float = _threshold(
        0.04, "1", "share of the power that nuisances alone leave that must come back without it: a fifth of the gap"
    )
    noticeable_error: float = _threshold(
        0.05, "1", "error (rms), as a share of the motion, below which a difference is of no interest"
    )
    large_error: float = _threshold(
        0.2, "1", "error (rms), as a share of the motion, whose removal counts however much weather is left"
    )

    plausible: float = _threshold(
        20.0, "1", "size in multiples of what real parts show, beyond its error, from which no cause is that large"
    )
    joint: float = _threshold(
        4.5,
        "1 sigma",
        "deviation of all derivatives together from the file up to which it is plausible by their tolerances",
    )

    bias: float = _threshold(
        3.0, "1 sigma", "size of a bias, beyond its error, from which it is more than what the file states of it"
    )

    def log_bayes_factor(self, searched: int) -> float:
        """Nats above which a candidate is accepted that was picked from so many effects (Bonferroni)."""
        return log(self.probability / (1.0 - self.probability)) + log(searched)


@dataclass(frozen=True)
class Search:
    """How far the search for explanations goes."""

    stages: tuple[tuple[int, int], ...] = _threshold(
        ((1, 6), (3, 4), (2, 3)),
        "1",
        "for the first, second and third effect: explanations that it is added to, candidates fitted upon each",
    )
    per_effect: int = _threshold(2, "1", "candidates of one effect that are fitted upon one explanation, at most")
    penalty: float = _threshold(
        10.0,
        "1",
        "deviance by which a variant of an effect, or one with an onset, must be better for each parameter more",
    )
    prior_gain: float = _threshold(
        3.0,
        "nat",
        "nats by which a candidate must make the derivatives more probable, by the file's tolerances, to be fitted for "
        "that alone",
    )
    alternatives: int = _threshold(4, "1", "alternatives to a cause that are fitted")
    sweeps: int = _threshold(3, "1", "times that all causes are compared with their alternatives, at most")
    lead: float = _threshold(
        1.0, "nat", "lead of an alternative, both kinds of evidence together, from which it replaces a cause"
    )
    tried_beside: float = _threshold(
        0.01, "1", "probability in a cause's place from which an alternative is also tried beside the cause"
    )


@dataclass(frozen=True)
class Calibration:
    """The probability that a cause is there, from its evidence."""

    constant: float = _threshold(-4.02, "1", "constant of the logistic regression", "bench/gap/calibration_weights.py")
    per_log_nat: float = _threshold(
        1.18, "1", "its weight of the natural logarithm of the log Bayes factor", "bench/gap/calibration_weights.py"
    )
    windows: float = _threshold(
        9.8,
        "1",
        "windows in which the commands excite a flight (effective number), to which the log Bayes factor is scaled: "
        "those of the flights that the weights were learned from",
        "chosen: excited_windows of fifteen of these is 9.7 to 9.9",
    )
    flexible: float = _threshold(-1.12, "1", "its weight of a flexible effect", "bench/gap/calibration_weights.py")
    flexible_effects: frozenset[str] = _threshold(
        frozenset({"derivative_error", "inertia_error", "mass_error", "cg_shift"}),
        "",
        "effects that act as other values of the file's derivatives: their many parameters fit much that is not theirs",
    )
    misspecification: float = _threshold(
        0.3,
        "1",
        "amplitude of what is left and depends on the effect, over what the effect does, from which it is misspecified",
        "chosen by eye between right and wrong causes (docs/results/gap_calibration.md)",
    )
    deviations: float = _threshold(
        4.5, "1 sigma", "deviation from chance from which what is left counts as misspecification"
    )
    counted: float = _threshold(
        0.1, "1", "share of a cause's power from which its misspecification on a channel counts"
    )
    least_power: float = _threshold(
        20.0, "1", "power of a cause on a channel, over the noise, below which its misspecification there is not tested"
    )
    probability: float = _threshold(0.5, "1", "probability below which a cause is not named: less likely than not")

    @property
    def weights(self) -> tuple[float, float, float]:
        """Weights (3,) of the logistic regression: of one, of the log nats, and of flexibility."""
        return self.constant, self.per_log_nat, self.flexible


@dataclass(frozen=True)
class Validation:
    """Errors on flight that was not fitted, and of the sizes."""

    motion: float = _threshold(4.0, "1", "power over that of the sensors' noise from which a channel or reading counts")
    chance: float = _threshold(
        1.5, "1", "ratio of an error to the noise floor that chance allows: half a minute of turbulence scatters by 1/4"
    )
    beyond_weather: float = _threshold(
        0.25, "1", "share of a reading's error power that causes must take away where weather could account for it"
    )
    large_improvement: float = _threshold(
        0.7, "1", "ratio of the error with causes to the file's, by one measure, from which a tie by another is no veto"
    )
    mean_improvement: float = _threshold(
        0.8,
        "1",
        "geometric mean over channels of the ratio of the error with causes to that of derivatives within their "
        "tolerances, by one measure, below which causes predict better whatever the worst channel does",
    )
    product: float = _threshold(
        0.5, "1", "ratio of the product of two measures' errors to the file's below which one may be worse than a tie"
    )
    tie: float = _threshold(1.05, "1", "ratio of the error with causes to the file's up to which it is a tie")
    implausible_derivatives: float = _threshold(
        1.1, "1", "largest ratio of the error with a cause to that of derivatives that are implausible together"
    )
    instruments: float = _threshold(
        0.5, "1", "share of the air's apparent power that is left from which errors of the instruments account for it"
    )
    discrepancy: float = _threshold(
        0.03, "1", "1 sigma by which a size is off beyond chance, as a share of itself", "bench/gap/size_errors.py"
    )


@dataclass(frozen=True)
class Verdict:
    """The verdict, and what is reported beside it."""

    told_apart: float = _threshold(
        0.8, "1", "share of the probability among its alternatives from which a cause is told apart from them"
    )
    structure: float = _threshold(
        4.5, "1 sigma", "deviation from chance from which what is left on one of twelve channels is structure"
    )
    explained: float = _threshold(
        0.8, "1", "share of what tolerances and noise leave that the causes must remove to be the explanation"
    )
    closed: float = _threshold(
        90.0, "%", "shrinkage of the gap that must lie within its interval for the causes to be the explanation"
    )
    error: float = _threshold(
        0.1, "1", "error (rms) beyond the noise floor, as a share of the motion, that needs a cause"
    )
    named: float = _threshold(0.03, "1", "probability above which an alternative is named beside a cause")
    shape: float = _threshold(3.0, "1 sigma", "deviation from chance from which the missing coefficient is drawn")
    most: float = _threshold(0.8, "1", "share of the power that the band and the time named for a gap hold")
    regime: float = _threshold(0.5, "1", "correlation of a signal's departures with the gap from which it is named")
    separated: float = _threshold(3.0, "1 sigma", "separation from which a proposed flight tells two effects apart")


@dataclass(frozen=True)
class Thresholds:
    """All of them, in the order of the argument."""

    admission: Admission = Admission()
    manoeuvre: ManoeuvreWindow = ManoeuvreWindow()
    priors: Priors = Priors()
    instruments: Instruments = Instruments()
    evidence: PredictiveEvidence = PredictiveEvidence()
    acceptance: Acceptance = Acceptance()
    search: Search = Search()
    calibration: Calibration = Calibration()
    validation: Validation = Validation()
    verdict: Verdict = Verdict()


#: The values in use.
THRESHOLDS = Thresholds()


class Threshold(NamedTuple):
    """One threshold: ``group.name``, its value and what is known of it."""

    name: str
    value: Any
    unit: str
    meaning: str
    source: str


def table(thresholds: Thresholds = THRESHOLDS) -> Iterator[Threshold]:
    """Every threshold, in order."""
    for group in fields(thresholds):
        values = getattr(thresholds, group.name)
        yield from (_row(group.name, values, entry) for entry in fields(values))


def _row(group: str, values: object, entry: Field[Any]) -> Threshold:
    known = entry.metadata
    name = f"{group}.{entry.name}"
    return Threshold(name, getattr(values, entry.name), known["unit"], known["meaning"], known["source"])
