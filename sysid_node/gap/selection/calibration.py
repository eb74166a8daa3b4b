"""The calibrated probability that a cause is there, from its evidence.

Evidence says how much better one model of the list predicts than another. If the true cause is not in the list, the log
evidence of the nearest candidate grows with the amount of data, and no such number is a probability (Bernardo & Smith
(1994), Bayesian Theory, sect. 6.1: the M-open case). A cause whose equation is refuted by what it leaves therefore has
no probability, and for the others the log Bayes factor is calibrated by a logistic regression over causes whose truth
was known (Platt (1999), Advances in Large Margin Classifiers). ``bench/gap/calibration_weights.py`` learns its weights.

What the tolerances of the aircraft file say is another kind of evidence. That all derivatives are off together as one
cause has them is improbable by the joint prior alone, and this does not grow with the amount of data. So much of the
log Bayes factor counts as it is, against as many effects as were searched (Bonferroni).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from sysid_node.gap.selection.misspecification import Misspecification
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds


@dataclass(frozen=True)
class CauseEvidence:
    """The evidence for and against one cause, the other causes given."""

    log_bayes_factor: float  # nats by which what the commands predict is better accounted for with the cause
    misspecification: float  # amplitude of what is left and depends on the cause, as a share of what the cause does
    flexible: bool  # the effect acts as other values of the file's derivatives
    windows: float = THRESHOLDS.calibration.windows  # in which the commands excite the flights (effective number)
    by_tolerances: float = 0.0  # nats of it that the joint prior of the derivatives gives
    searched: int = 1  # number of effects that the cause was picked from


def evidence_of(
    effect: str,
    log_bayes_factor: float,
    tested: Misspecification,
    windows: float,
    by_tolerances: float = 0.0,
    searched: int = 1,
    thresholds: Thresholds = THRESHOLDS,
) -> CauseEvidence:
    """The evidence of an effect from its log Bayes factor (nats) and the test of its equation.

    ``by_tolerances`` (nats) is what the derivatives' joint prior says for it, of which no more counts than the log
    Bayes factor, in which the effect's own prior is.
    """
    flexible = is_flexible(effect, thresholds)
    prior = max(min(by_tolerances, log_bayes_factor), 0.0)
    return CauseEvidence(log_bayes_factor, misspecification_of(tested, thresholds), flexible, windows, prior, searched)


def misspecification_of(tested: Misspecification, thresholds: Thresholds = THRESHOLDS) -> float:
    """Amplitude of what is left and depends on the cause, as a share of what the cause does.

    Only channels count on which the cause counts and on which what is left is significant.
    """
    limits = thresholds.calibration
    counts = tested.contributed > limits.counted * tested.contributed.sum()
    significant = counts & (tested.deviations > limits.deviations)
    if not significant.any():
        return 0.0
    return float(np.sqrt(tested.explained[significant].sum() / tested.contributed[significant].sum()))


def calibrated_probability(evidence: CauseEvidence, thresholds: Thresholds = THRESHOLDS) -> float:
    """Probability that the cause, or an alternative named with it, is there; zero where it is misspecified."""
    return 0.0 if is_misspecified(evidence, thresholds) else probability_by_support(evidence, thresholds)


def is_misspecified(evidence: CauseEvidence, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether too much of what is left depends on the cause: its equation is another, however large its support."""
    return evidence.misspecification > thresholds.calibration.misspecification


def is_supported_but_misspecified(evidence: CauseEvidence, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether the cause would be kept but for its misspecification: then something is there, but not this effect."""
    likely = probability_by_support(evidence, thresholds) >= thresholds.calibration.probability
    return is_misspecified(evidence, thresholds) and likely


def regressors(evidence: CauseEvidence, thresholds: Thresholds = THRESHOLDS) -> tuple[float, float, float]:
    """Regressors (3,) of the logistic regression: one, log of the log Bayes factor (at least 1 nat), flexibility.

    The log Bayes factor is that of as much excited flight as the weights were learned from.
    """
    scaled = evidence.log_bayes_factor * thresholds.calibration.windows / evidence.windows
    return 1.0, float(np.log(max(scaled, 1.0))), float(evidence.flexible)


def is_flexible(effect: str, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether an effect acts as other values of the derivatives, so that it can imitate other effects."""
    return effect in thresholds.calibration.flexible_effects


def imitation(own: float, imitated: float) -> float:
    """Probability that an effect only imitates another, from the log Bayes factor (nats) of each."""
    return float(expit(imitated - own))


def prior_odds(effect: str, thresholds: Thresholds = THRESHOLDS) -> float:
    """Odds of an effect before any flight, relative to an effect that is not flexible."""
    return float(np.exp(thresholds.calibration.flexible)) if is_flexible(effect, thresholds) else 1.0


def probability_by_support(evidence: CauseEvidence, thresholds: Thresholds = THRESHOLDS) -> float:
    """The larger of the logistic regression's probability and that by the tolerances, misspecified or not."""
    log_odds = float(np.dot(thresholds.calibration.weights, regressors(evidence, thresholds)))
    by_tolerances = evidence.by_tolerances - float(np.log(evidence.searched))
    if evidence.by_tolerances > 0.0:
        log_odds = max(log_odds, by_tolerances + thresholds.calibration.flexible * evidence.flexible)
    return 1.0 / (1.0 + float(np.exp(-log_odds)))
