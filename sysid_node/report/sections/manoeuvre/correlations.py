"""Correlations of the predicted errors: a map, and the pairs that are hard to distinguish."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.report.results.manoeuvre_result import ManoeuvreResult
from sysid_node.report.wording.names import symbol
from sysid_node.report.wording.numbers import number

#: Correlation beyond which two derivatives are named (Klein & Morelli (2006), sect. 5.4).
THRESHOLD = 0.9


def context(result: ManoeuvreResult) -> Mapping[str, Any]:
    """Cells of the map and pairs in words."""
    information = result.prediction.information
    cells = [
        {
            "row": i,
            "column": j,
            "value": number(value, 2),
            "opacity": f"{abs(value):.2f}",
            "positive": value > 0,
            "title": f"{information.names[i]}, {information.names[j]}",
        }
        for i, row in enumerate(information.correlations.tolist())
        for j, value in enumerate(row)
        if j < i and abs(value) >= 0.05
    ]
    pairs = [(symbol(a), symbol(b), number(value, 2)) for a, b, value in information.pairs(THRESHOLD)]
    return {"names": information.names, "cells": cells, "pairs": pairs, "threshold": THRESHOLD}
