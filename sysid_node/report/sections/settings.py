"""The settings of the run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.report.results.run_result import RunResult
from sysid_node.report.sections.section import Section
from sysid_node.report.wording.numbers import setting

#: Units of the settings that have one.
UNITS = {
    "frequencies": "Hz",
    "forgetting_time": "s",
    "window": "s",
    "settle_time": "s",
    "max_gap": "s",
    "publish_rate": "Hz",
}


def context(run: RunResult) -> Mapping[str, Any]:
    """Keys as they are given to ``--set``, their values and units."""
    return {"rows": [(key, setting(value), UNITS.get(key, "")) for key, value in run.settings.items()]}


SECTION: Section[RunResult] = Section("settings", "Settings", "settings.html.j2", context)
