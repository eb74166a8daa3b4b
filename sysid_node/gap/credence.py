"""How far a cause can be believed: what speaks for it, and how often as much has spoken for what was there.

Evidence says how much better one model of the list predicts than another. Where the truth is none of them, the least
wrong one wins by as many nats as there are data, and no number of these is a probability (Bernardo & Smith (1994),
Bayesian Theory, sect. 6.1: the M-open case). So the nats, and whether what is left goes with the cause, are turned into
a probability by a logistic regression over causes whose truth was known (Platt (1999), Advances in Large Margin
Classifiers). ``bench/gap_credence.py`` learns its weights from flights of the development set.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sysid_node.gap.adequacy import Adequacy
from sysid_node.gap.nuisance import WIDENED

#: Weights of a constant, of the logarithm of the nats, of the misfit, and of derivatives beyond their tolerances, which
#: the file itself says are improbable (bench/gap_credence.py).
WEIGHTS = (-3.5, 1.1, -4.0, -1.5)

#: Probability below which a cause is not named.
LIKELY = 0.5

#: Standard deviations above chance from which what is left goes with a cause.
_DEVIATIONS = 4.5

#: Share of all that a cause does from which what it does to one channel counts.
_COUNTS = 0.1


@dataclass(frozen=True)
class Grounds:
    """What speaks for a cause and against it."""

    foretold: float  # nats by which it accounts better for what the commands foretell, the other causes given
    misfit: float  # of what it does to a channel, what is left that goes with it: amplitude, the worst channel
    denied: bool  # by the aircraft file's own tolerances

    @classmethod
    def of(cls, effect: str, foretold: float, adequacy: Adequacy) -> Grounds:
        """From the effect, the nats, and what it leaves."""
        counted = (adequacy.done > _COUNTS * adequacy.done.sum()) & (adequacy.deviations > _DEVIATIONS)
        ratio = np.divide(adequacy.left, adequacy.done, out=np.zeros_like(adequacy.left), where=counted)
        return cls(foretold, float(np.sqrt(ratio.max())), effect == WIDENED)

    @property
    def regressors(self) -> tuple[float, float, float, float]:
        """What the weights belong to."""
        return 1.0, float(np.log(max(self.foretold, 1.0))), self.misfit, float(self.denied)

    @property
    def credence(self) -> float:
        """Probability that the cause, or a rival named with it, is there."""
        return 1.0 / (1.0 + float(np.exp(-np.dot(WEIGHTS, self.regressors))))

    @property
    def wanting(self) -> bool:
        """Whether it is doubted for what it leaves alone: then something is there, but not this."""
        return self.credence < LIKELY <= replace(self, misfit=0.0).credence


def prior(effect: str) -> float:
    """Odds of an effect before any flight, beside those that the aircraft file says nothing of."""
    return float(np.exp(WEIGHTS[3])) if effect == WIDENED else 1.0
