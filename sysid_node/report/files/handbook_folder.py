"""The folder of ``sysid aircraft``: ``aircraft.json`` and the report."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sysid_node.dynamics.handbook.handbook import Handbook
from sysid_node.online.types import Estimates
from sysid_node.report.pages.handbook_page import write_handbook_report


def write_handbook(folder: Path, book: Handbook, expected: Estimates | str) -> None:
    """Write aircraft.json and report.html; ``expected`` are the estimates of a usual flight, or why there are none."""
    text = json.dumps(content(book, expected), indent=2, ensure_ascii=False, allow_nan=False)
    (folder / "aircraft.json").write_text(text + "\n", encoding="utf-8")
    write_handbook_report(folder / "report.html", book, expected)


def content(book: Handbook, expected: Estimates | str) -> dict[str, Any]:
    """The content of ``aircraft.json``: SI units and radians; what the file does not tell is null."""
    modes = {
        mode.name: {
            "eigenvalue": [mode.eigenvalue.real, mode.eigenvalue.imag],
            "frequency": mode.frequency,
            "damping": mode.damping,
            "stable": mode.stable,
            "time_to_half_or_double": mode.time_to_half,
        }
        for mode in book.modes
    }
    found = {
        "aircraft": book.aircraft.name,
        "trim": [asdict(trim) for trim in book.trims],
        "static_margin": {"value": book.static_margin, "standard_error": book.static_margin_error},
        "modes": modes,
        "performance": asdict(book.performance),
        "control_power": asdict(book.power),
        "derivatives_at_trim": dict(book.slopes),
        "checks": [{**asdict(f), "unusual": f.unusual} for f in book.findings],
        "left_out": list(book.left_out),
        "error_budget": None if isinstance(expected, str) else _error_budget(expected),
    }
    plain: dict[str, Any] = _finite(found)
    return plain


def _error_budget(expected: Estimates) -> dict[str, Any]:
    """By derivative its standard error and the shares of its variance by source."""
    return {
        name: {"standard_error": expected.derivatives[name].standard_error, "shares": dict(shares)}
        for name, shares in expected.budget.items()
    }


def _finite(value: Any) -> Any:
    """The same with null for numbers that are not finite, which JSON does not have."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
