"""The causes with their parameters, the candidates with their shares, and which of them the flight can distinguish."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import document
from sysid_node.report.sections.gap.names import alike, units_of
from sysid_node.report.wording.names import words_of
from sysid_node.report.wording.numbers import NONE, likely, number, with_interval


def candidates(found: Diagnosis) -> Mapping[str, Any]:
    """The effects that were fitted alone, and the causes with their parameters."""
    content = document(found)
    rows = [
        (words_of(c["effect"]), NONE if c["probability"] is None else likely(c["probability"]),
         f"{100 * c['share']:.1f}", 100 * c["share"])
        for c in content["candidates"]
    ]  # fmt: skip
    doubted = [_doubted(c) for c in content["doubted"]]
    causes = [
        {
            "name": words_of(c["label"]),
            "station": c["station"],
            "probability": likely(c["probability"]),
            "parameters": _parameters(c),
            "rivals": ", ".join(words_of(r) for r in c["indistinguishable_from"]),
        }
        for c in content["causes"]
    ]
    return {"rows": rows, "causes": causes, "doubted": ", ".join(doubted), "confusion": _confusion(found)}


def _doubted(cause: Mapping[str, Any]) -> str:
    """``actuator lag (probability 0.42; time constant 0.110 ± 0.006 s)``."""
    details = [f"probability {likely(cause['probability'])}", *map(" ".join, _parameters(cause))]
    return f"{words_of(cause['label'])} ({'; '.join(details)})"


def _parameters(cause: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value with its 95 % interval, and unit of each of a cause's parameters."""
    units = units_of(cause["effect"])
    filed = alike(cause.get("believed", {}))
    return [
        (words_of(n), with_interval(v, 1.96 * e), units.get(n, "") + (f" (file: {filed[n]:.3g})" if n in filed else ""))
        for n, (v, e) in alike(cause["parameters"]).items()
    ]


def _confusion(found: Diagnosis) -> Mapping[str, Any]:
    """Cells of the map that shows which effects the flight cannot distinguish."""
    table = found.confusion
    cells = [
        {"row": i, "column": j, "value": number(value, 2), "opacity": f"{abs(value):.2f}", "positive": value > 0}
        for i, row in enumerate(table.cosines.tolist())
        for j, value in enumerate(row)
        if j < i and abs(value) >= 0.05
    ]
    return {"names": [words_of(label) for label in table.labels], "cells": cells}
