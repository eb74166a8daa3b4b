"""What remains that the causes of a gap do not explain, in a sentence."""

from __future__ import annotations

import numpy as np

from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.gap.verdict.decision import (
    VerdictScores,
    closes_too_little,
    structure_left,
    structured_channels,
)
from sysid_node.report.wording.causes import WORDS, label_words, percent

#: Channels that are named, at most.
_MOST = 3


def what_remains(scores: VerdictScores) -> str:
    """What remains that the causes do not explain, by the rule that led to the verdict."""
    if closes_too_little(scores.simulation):
        return "A large part remains that none of the known effects predicts."
    left, which = np.sqrt(structure_left(scores)), np.flatnonzero(structured_channels(scores))
    if which.size:
        most = sorted(which.tolist(), key=lambda i: -left[i])[:_MOST]
        parts = ", ".join(f"{percent(left[i])} of the {WORDS[CHANNELS[i]]}" for i in most)
        return f"In forces and kinematics, a part remains that none of the known effects predicts: {parts}."
    alike = [c.label for c in scores.rejected if c.supported_but_misspecified and not c.replaced]
    if alike:
        return f"Something remains that resembles {label_words(alike[0])}, but does not follow its equation."
    return "On flight that was not fitted, derivatives within their tolerances predict forces and moments as well."
