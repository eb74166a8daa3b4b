"""The settings that gave these numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.report.data import RunResult
from sysid_node.report.sections import Section
from sysid_node.report.words import setting


def context(run: RunResult) -> Mapping[str, Any]:
    """Keys as they are given to ``--set``, and their values."""
    return {"rows": [(key, setting(value)) for key, value in run.settings.items()]}


SECTION: Section[RunResult] = Section("settings", "Settings", "settings.html.j2", context)
