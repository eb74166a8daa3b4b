"""The shape of the force or moment that the simulator lacks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.verdict.decision import structured_channels
from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import Figure
from sysid_node.report.wording.causes import WORDS, signal_words
from sysid_node.report.wording.numbers import number


def shape(found: Diagnosis) -> Mapping[str, Any]:
    """The missing coefficient against what it depends on most."""
    missing = found.shape
    if missing is None:
        return {"figure": None, "words": "", "left": bool(structured_channels(found.scores).any())}
    signal = signal_words(missing.signal)
    trace = figures.line(missing.centres, missing.means, missing.axis)
    trace |= {"mode": "lines+markers", "error_y": {"type": "data", "array": (1.96 * missing.errors).tolist()}}
    layout = {
        "xaxis": figures.axis(f"{signal}, {missing.unit}"),
        "yaxis": figures.axis(f"missing {missing.axis}"),
    }
    words = f"The missing {WORDS[missing.axis]} against {signal}"
    return {
        "figure": Figure(words, [trace], layout, 300),
        "words": f"{words}; the bins explain {number(100 * missing.explained, 2)} % of it",
        "left": bool(structured_channels(found.scores).any()),
    }
