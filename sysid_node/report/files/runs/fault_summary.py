"""Faults of a flight in ``summary.json``, written and read back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from sysid_node.faults.recorded_flight import Episode, FaultVerdict
from sysid_node.faults.types import DerivativeChange, Fault


def as_summary(verdict: FaultVerdict | None) -> dict[str, Any] | None:
    """``{judged_seconds, found: [{kind, part, size, ..., until}, ...]}``; null if no faults were looked for."""
    if verdict is None:
        return None
    found = [_row(episode.fault) | {"until": episode.until} for episode in verdict.episodes]
    return {"judged_seconds": verdict.judged, "found": found}


def from_summary(found: Mapping[str, Any] | None) -> FaultVerdict | None:
    """The faults from ``summary.json``; the reports over time are in the bag."""
    if not found:
        return None
    return FaultVerdict(found["judged_seconds"], episodes=[_episode(row) for row in found["found"]])


def _row(fault: Fault) -> dict[str, Any]:
    row = {field.name: getattr(fault, field.name) for field in fields(fault)}
    return row | {"changes": [change._asdict() for change in fault.changes]}


def _episode(row: Mapping[str, Any]) -> Episode:
    known = {field.name: row[field.name] for field in fields(Fault)}
    known |= {name: math.nan for name in ("size", "lower", "upper") if row[name] is None}
    known["changes"] = tuple(DerivativeChange(**change) for change in row["changes"])
    return Episode(Fault(**known), row["until"])
