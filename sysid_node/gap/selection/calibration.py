"""How far a cause can be believed: what speaks for it, and how often as much has spoken for what was there.

Evidence says how much better one model of the list predicts than another. Where the truth is none of them, the least
wrong one wins by as many nats as there are data, and no number of these is a probability (Bernardo & Smith (1994),
Bayesian Theory, sect. 6.1: the M-open case). So a cause whose law is refuted by what it leaves is not believed at all,
and for the others the nats are made a probability by a logistic regression over causes whose truth was known (Platt
(1999), Advances in Large Margin Classifiers). ``bench/gap_credence.py`` learns its weights from the withheld
effects that earlier versions were judged by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sysid_node.gap.selection.misspecification import Misspecification
from sysid_node.gap.thresholds import THRESHOLDS


@dataclass(frozen=True)
class CauseEvidence:
    """What speaks for a cause and against it."""

    log_bayes_factor: float  # nats by which it accounts better for what the commands foretell, the other causes given
    misfit: float  # of what it does, what is left that goes with it: amplitude, on the channels where any is left
    flexible: bool  # as what works through the file's own derivatives is

    @classmethod
    def of(cls, effect: str, foretold: float, adequacy: Misspecification) -> CauseEvidence:
        """From the effect, the nats, and what it leaves."""
        seen = (adequacy.done > THRESHOLDS.calibration.counted * adequacy.done.sum()) & (
            adequacy.deviations > THRESHOLDS.calibration.deviations
        )
        misfit = np.sqrt(adequacy.left[seen].sum() / adequacy.done[seen].sum()) if seen.any() else 0.0
        return cls(foretold, float(misfit), effect in THRESHOLDS.calibration.flexible_effects)

    @property
    def regressors(self) -> tuple[float, float, float]:
        """What the weights belong to."""
        return 1.0, float(np.log(max(self.log_bayes_factor, 1.0))), float(self.flexible)

    @property
    def misspecified(self) -> bool:
        """Whether what is left goes with the cause by too much: then the law is another, however many the nats."""
        return self.misfit > THRESHOLDS.calibration.misfit

    @property
    def probability_by_evidence(self) -> float:
        """Probability that the cause, or a rival named with it, is there."""
        return 0.0 if self.misspecified else self._by_nats

    @property
    def supported_but_misspecified(self) -> bool:
        """Whether it would be believed but for its law: then something is there, but not this."""
        return self.misspecified and self._by_nats >= THRESHOLDS.calibration.probability

    @property
    def _by_nats(self) -> float:
        return 1.0 / (1.0 + float(np.exp(-np.dot(THRESHOLDS.calibration.weights, self.regressors))))


def prior_odds(effect: str) -> float:
    """Odds of an effect before any flight, beside those that are not flexible."""
    return float(np.exp(THRESHOLDS.calibration.flexible)) if effect in THRESHOLDS.calibration.flexible_effects else 1.0
