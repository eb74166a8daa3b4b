"""The predicted standard error of each derivative."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from sysid_node.excite.optimise import posterior_to_prior_ratios
from sysid_node.excite.prediction import tolerances_of
from sysid_node.report.results.manoeuvre_result import ManoeuvreResult
from sysid_node.report.sections.groups import grouped
from sysid_node.report.wording.names import short_meaning, symbol
from sysid_node.report.wording.numbers import number

#: Share of the tolerance that is left at most of a derivative that the manoeuvre shows.
_SEEN = 0.9


@dataclass(frozen=True)
class PredictionRow:
    """One derivative as the table shows it."""

    name: str
    symbol: Markup
    meaning: str
    value: str
    tolerance: str
    error: str
    relative: str  # percent of the value
    before: str  # standard error of the initial manoeuvre, if it was optimised
    left: float  # percent of the tolerance
    seen: bool


def context(result: ManoeuvreResult) -> Mapping[str, Any]:
    """Groups of rows."""
    information = result.prediction.information
    left = _left(result)
    errors = information.standard_errors
    before = result.optimum.start.information.standard_errors if result.optimum else np.full(errors.size, np.nan)
    rows = {
        name: _row(result, name, float(error), float(start), float(share))
        for name, error, start, share in zip(information.names, errors, before, left, strict=True)
    }
    groups = [(title, [rows[name] for name in names]) for title, names in grouped(rows)]
    return {"groups": groups, "optimised": result.optimum is not None}


def hardly_seen(result: ManoeuvreResult) -> list[str]:
    """The derivatives of which the manoeuvre tells hardly more than the aircraft file."""
    left = _left(result)
    return [name for name, share in zip(result.prediction.information.names, left, strict=True) if share >= _SEEN]


def _left(result: ManoeuvreResult) -> NDArray[np.float64]:
    """What is left of each derivative's tolerance, as a share of it."""
    return posterior_to_prior_ratios(result.prediction.information, tolerances_of(result.aircraft))


def _row(result: ManoeuvreResult, name: str, error: float, before: float, left: float) -> PredictionRow:
    derivative = result.aircraft.derivatives[name]
    return PredictionRow(
        name=name,
        symbol=symbol(name),
        meaning=short_meaning(name),
        value=number(derivative.value),
        tolerance="" if derivative.tolerance is None else number(derivative.tolerance, 2),
        error=number(error, 2),
        relative=f"{number(100 * error / abs(derivative.value), 2)}\u202f%" if derivative.value else "",
        before=number(before, 2),
        left=100 * left,
        seen=left < _SEEN,
    )
