"""The opening of a gap's report: the paragraph, the size of the gap, and its table by channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.short_flights.readings import length_of
from sysid_node.gap.validation.spectral_error import STAGES
from sysid_node.report.sections.gap.paragraph import paragraph
from sysid_node.report.wording.causes import MEASURED_ON, WORDS, percent
from sysid_node.report.wording.names import words_of
from sysid_node.report.wording.numbers import number, percentage
from sysid_node.sim.signals.low_pass import CORNER

#: The stages of a gap's error, in words.
_STAGE_WORDS = ("Gap before", "Within tolerances", "Gap after", "Noise floor")


def opening(found: Diagnosis, warnings: Sequence[str] = ()) -> Mapping[str, Any]:
    """The paragraph, the warnings about the flights, and the figures beside it."""
    gap, model = found.size, found.models[0]
    low, high = gap.ci95
    length = f"{length_of(found.models[0]):g}" if found.simulation_gap else f"{found.models[0].windows.length:.2g}"
    ends = f" ({percentage(low)} to {percentage(high)})" if low < high else ""  # equal where nothing scatters
    facts = [
        ("Verdict", words_of(found.verdict)),
        *((words, percent(getattr(gap, stage))) for words, stage in zip(_STAGE_WORDS, STAGES, strict=True)),
        ("Closed", f"{percentage(gap.shrink_percent)} %{ends}"),
    ]
    return {
        "text": paragraph(found),
        "warnings": warnings,
        "facts": facts,
        "next_flight": found.next_flight,
        "short": bool(found.simulation_gap),
        "window": f"{length} s",
        "low_pass": f"{CORNER * model.simulator.rate:.2g} Hz",
        "highest": f"{model.windows.frequencies[-1]:.2g} Hz",
        "vanes": not any(one.flight.inferred for one in found.models),
    }


def channels(found: Diagnosis) -> Mapping[str, Any]:
    """The gap of each channel before and after, beside its noise floor, and of all together with its intervals."""
    gap = found.size
    rows = [(WORDS[name], *(percent(c[stage]) for stage in STAGES)) for name, c in gap.per_channel.items()]
    whole = ("all together", *(percent(getattr(gap, stage)) for stage in STAGES))
    ends = ("95 % interval", *(_between(gap.intervals[stage]) for stage in STAGES))
    return {
        "rows": rows,
        "whole": [whole, ends],
        "measured_on": MEASURED_ON[found.measured_on],
        "short": bool(found.simulation_gap),
        "window": f"{length_of(found.models[0]):g} s",
    }


def _between(ends: tuple[float, float]) -> str:
    """``12 to 15 %``."""
    return f"{number(100.0 * ends[0], 2)} to {percent(ends[1])}"
