"""The faults that the fault monitor would have reported in flight."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from sysid_node.faults.recorded_flight import Episode
from sysid_node.faults.types import amount
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.sections.section import Section
from sysid_node.report.wording.numbers import number, seconds

#: Derivatives that are listed with a fault: those that changed most surely.
_SHOWN = 4


def context(run: RunResult) -> Mapping[str, Any]:
    """Rows of the table, and the length of flight that was checked."""
    if run.faults is None:
        return {"judged": None, "rows": []}
    return {"judged": seconds(run.faults.judged), "rows": [_row(episode) for episode in run.faults.episodes]}


def _row(episode: Episode) -> dict[str, str]:
    fault = episode.fault
    known, sure = math.isfinite(fault.size), math.isfinite(fault.lower)
    interval = f"{amount(fault.lower, fault.unit)} to {amount(fault.upper, fault.unit)}" if sure else ""
    return {
        "what": f"{fault.part}: {fault.kind}",
        "size": amount(fault.size, fault.unit) if known else "",
        "interval": interval,
        "changes": ", ".join(
            f"{c.name} {c.value:+.3g} ({c.lower:+.3g} to {c.upper:+.3g})" for c in fault.changes[:_SHOWN]
        )
        + (f" and {len(fault.changes) - _SHOWN} more" if len(fault.changes) > _SHOWN else ""),
        "since": f"{fault.since:.1f}",
        "found": f"{fault.found:.1f}",
        "until": "to the end" if episode.until is None else f"{episode.until:.1f}",
        "source": fault.source,
        "probability": f"{number(100.0 * fault.probability, 3)}\u202f%",
    }


SECTION: Section[RunResult] = Section("faults", "Faults", "faults.html.j2", context)
