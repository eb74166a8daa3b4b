"""The final table: every derivative with its interval, in numbers and as a picture."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from sysid_node.online.types import DerivativeEstimate
from sysid_node.report.results.comparison import NORMAL_95, agrees, covers, half_width
from sysid_node.report.results.run_result import Prior, RunResult
from sysid_node.report.sections.groups import grouped
from sysid_node.report.sections.section import Section
from sysid_node.report.wording.names import meaning, short_meaning, symbol, unit
from sysid_node.report.wording.numbers import number, with_interval

#: Half widths, as fractions of the reference, that the picture's axis may take.
SPANS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)


@dataclass(frozen=True)
class Mark:
    """A value with its interval on the picture's axis: percent of its width, cut at the edges."""

    at: float
    lower: float
    upper: float
    beyond: str = ""  # "left" or "right" where the value itself lies outside the axis


@dataclass(frozen=True)
class DerivativeRow:
    """One derivative as the table shows it."""

    name: str
    symbol: Markup
    meaning: str  # a few words
    explanation: str  # in full
    unit: str
    estimate: str
    valid: bool
    status: str
    prior: str
    differs: bool  # from the prior, by more than both uncertainties
    truth: str
    missed: bool  # valid, but the interval does not contain the true value
    mark: Mark | None
    prior_mark: Mark | None


def context(run: RunResult) -> Mapping[str, Any]:
    """Groups of rows and the picture's axis."""
    estimates = run.final.derivatives if run.final else {}
    span = _span(run, estimates.values())
    groups = [(title, [_row(run, estimates[name], span) for name in names]) for title, names in grouped(estimates)]
    return {
        "groups": groups,
        "span": f"{number(100 * span, 2)}\u202f%",
        "reference": "true value" if run.references.truth else "aircraft file" if run.references.prior else "",
        "has_prior": bool(run.references.prior),
        "has_truth": bool(run.references.truth),
    }


def _row(run: RunResult, d: DerivativeEstimate, span: float) -> DerivativeRow:
    prior, truth, reference = (
        run.references.prior.get(d.name),
        run.references.truth.get(d.name),
        _reference(run, d.name),
    )
    drawn = math.isfinite(reference) and reference != 0.0
    return DerivativeRow(
        name=d.name,
        symbol=symbol(d.name),
        meaning=short_meaning(d.name),
        explanation=meaning(d.name),
        unit=unit(d.name),
        estimate=with_interval(d.value, half_width(d)),
        valid=d.valid,
        status="valid" if d.valid and d.status == "ok" else d.status,
        prior="" if prior is None else with_interval(prior.value, NORMAL_95 * prior.tolerance),
        differs=d.valid and prior is not None and not agrees(d, prior),
        truth="" if truth is None else number(truth),
        missed=d.valid and truth is not None and not covers(d, truth),
        mark=_mark(d.value, half_width(d), reference, span) if drawn else None,
        prior_mark=_prior_mark(prior, reference, span) if drawn and prior is not None else None,
    )


def _reference(run: RunResult, name: str) -> float:
    """The reference of the picture: the truth where any is known, else the prior; NaN = neither."""
    if run.references.truth:
        return run.references.truth.get(name, math.nan)
    return run.references.prior[name].value if name in run.references.prior else math.nan


def _span(run: RunResult, estimates: Iterable[DerivativeEstimate]) -> float:
    """The smallest axis that shows most valid intervals completely."""
    reach = [
        max(abs(d.lower - reference), abs(d.upper - reference)) / abs(reference)
        for d in estimates
        if d.valid and (reference := _reference(run, d.name))
    ]
    reach = [value for value in reach if math.isfinite(value)]
    wanted = float(np.percentile(reach, 85)) if reach else 1.0
    return next((span for span in SPANS if span >= wanted), SPANS[-1])


def _mark(value: float, half: float, reference: float, span: float) -> Mark | None:
    """The place of a value and its interval on an axis from -span to +span about the reference; larger is right."""
    if not math.isfinite(value):
        return None
    at = 50.0 + 50.0 * (value / reference - 1.0) / span
    reach = 50.0 * half / (abs(reference) * span) if math.isfinite(half) else 0.0
    beyond = "left" if at < 0 else "right" if at > 100 else ""
    return Mark(_inside(at), _inside(at - reach), _inside(at + reach), beyond)


def _inside(place: float) -> float:
    return min(max(place, 0.0), 100.0)


def _prior_mark(prior: Prior, reference: float, span: float) -> Mark | None:
    return _mark(prior.value, NORMAL_95 * prior.tolerance, reference, span)


SECTION: Section[RunResult] = Section("derivatives", "Derivatives", "derivatives.html.j2", context)
