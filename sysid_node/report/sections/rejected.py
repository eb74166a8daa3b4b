"""Messages that were rejected, by topic and reason."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.report.results.run_result import RunResult
from sysid_node.report.sections.section import Section


def context(run: RunResult) -> Mapping[str, Any]:
    """Rows (topic, reason, count), the most frequent first."""
    rows = [(*_split(key), count) for key, count in run.data.rejected.items() if count]
    return {"rows": sorted(rows, key=lambda row: -row[2]), "total": sum(row[2] for row in rows)}


def _split(key: str) -> tuple[str, str]:
    topic, separator, reason = key.partition(": ")
    return (topic, reason) if separator else ("", key)


SECTION: Section[RunResult] = Section("rejected", "Rejected messages", "rejected.html.j2", context)
