"""The flight as flown in the user's simulator, with its model as it was and with the correction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.reflying import InSimulator
from sysid_node.gap.short_flights.readings import length_of
from sysid_node.report.sections.gap.flight import most_off, short_flight_panels
from sysid_node.report.wording.causes import WORDS, label_words, percent
from sysid_node.report.wording.numbers import percentage

_STAGES = ("before", "after", "noise_floor")


def reflown(found: Diagnosis, flown: InSimulator) -> Mapping[str, Any]:
    """Errors before and after as flown there, the traces of both, and what the simulator's model cannot hold."""
    left_out = [(label_words(effect), why) for effect, why in flown.left_out.items()]
    window = f"{length_of(found.models[0]):g} s"
    content: dict[str, Any] = {"left_out": left_out, "simulator": flown.simulator.label, "window": window}
    if flown.result is None:
        return {**content, "flown": False}
    gap, (low, high) = flown.result.gap, flown.result.gap.ci95
    rows = [(WORDS[name], *(percent(errors[s]) for s in _STAGES)) for name, errors in gap.per_channel.items()]
    return {
        **content,
        "flown": True,
        "closed": f"{percentage(gap.shrink_percent)} % ({percentage(low)} to {percentage(high)})",
        "rows": rows,
        "whole": ("all together", *(percent(getattr(gap, stage)) for stage in _STAGES)),
        "held_out": found.held_out,
        "panels": short_flight_panels(
            most_off(flown.result.flights), list(gap.per_channel), ("as it was", "corrected")
        ),
    }
