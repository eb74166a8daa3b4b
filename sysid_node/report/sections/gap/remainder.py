"""What remains that the causes of a gap do not explain, in a sentence."""

from __future__ import annotations

import numpy as np

from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.gap.verdict import decision
from sysid_node.gap.verdict.decision import Decision, VerdictScores, structure_left
from sysid_node.report.wording.causes import WORDS, label_words, percent

#: Channels that are named, at most.
_MOST = 3

_OPEN = "A large part remains that none of the known effects predicts."
_NO_BETTER = "On flight that was not fitted, derivatives within their tolerances predict forces and moments as well."


def what_remains(decided: Decision, scores: VerdictScores) -> str:
    """What remains that the causes do not explain, by the rule that gave the verdict."""
    if decided.reason == decision.NO_BETTER:
        return _NO_BETTER
    if decided.reason in (decision.SMALL_SHARE, decision.STRUCTURED):
        left = np.sqrt(structure_left(scores))
        most = [i for i in np.argsort(-left).tolist() if left[i] > 0.0][:_MOST]
        parts = ", ".join(f"{percent(left[i])} of the {WORDS[CHANNELS[i]]}" for i in most)
        return f"In forces and kinematics, a part remains that none of the known effects predicts: {parts}."
    if decided.reason == decision.RESEMBLING:
        alike = next(c.label for c in scores.rejected if c.supported_but_misspecified and not c.replaced)
        return f"Something remains that resembles {label_words(alike)}, but does not follow its equation."
    return _OPEN
