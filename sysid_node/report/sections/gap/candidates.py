"""The causes with their parameters, the candidates with their shares, and which of them the flight can distinguish."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import document
from sysid_node.report.wording.causes import alike, label_words, parameter_words, units_of
from sysid_node.report.wording.numbers import NONE, likely, number, with_interval


def candidates(found: Diagnosis) -> Mapping[str, Any]:
    """The effects that were fitted alone, and the causes with their parameters."""
    content = document(found)
    named = [c["effect"] for c in content["causes"]]
    rows = [
        (label_words(c["effect"]), _probability(c, named), f"{100 * c['share']:.1f}", 100 * c["share"])
        for c in content["candidates"]
    ]
    doubted = [_doubted(c) for c in content["doubted"]]
    causes = [
        {
            "name": label_words(c["label"]),
            "station": c["station"],
            "probability": likely(c["probability"]),
            "parameters": _parameters(c),
            "rivals": ", ".join(label_words(r) for r in c["indistinguishable_from"]),
        }
        for c in content["causes"]
    ]
    return {"rows": rows, "causes": causes, "doubted": ", ".join(doubted), "confusion": _confusion(found)}


def _probability(candidate: Mapping[str, Any], causes: Sequence[str]) -> str:
    """The probability of a candidate, or why it has none: it is a cause's effect with other parameters."""
    if candidate["probability"] is not None:
        return likely(candidate["probability"])
    return "as the cause" if any(candidate["effect"].startswith(f"{effect} of ") for effect in causes) else NONE


def _doubted(cause: Mapping[str, Any]) -> str:
    """``actuator lag (probability 0.42; time constant 0.110 ± 0.006 s)``."""
    details = [f"probability {likely(cause['probability'])}", *(" ".join(filter(None, p)) for p in _parameters(cause))]
    return f"{label_words(cause['label'])} ({'; '.join(details)})"


def _parameters(cause: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value with its 95 % interval, and unit of each of a cause's parameters."""
    units = units_of(cause["effect"])
    filed = alike(cause.get("believed", {}))
    files = {name: f" (file: {value:.3g})" for name, value in filed.items()}
    pairs = alike(cause["parameters"]).items()
    return [
        (parameter_words(n), with_interval(v, 1.96 * e), units.get(n, "") + files.get(n, "")) for n, (v, e) in pairs
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
    return {"names": [label_words(label) for label in table.labels], "cells": cells}
