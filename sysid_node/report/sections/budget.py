"""What each derivative's uncertainty is made of, and what to weigh, measure or calibrate next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from sysid_node.online.types import Estimates
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.sections.section import Section
from sysid_node.report.wording.names import symbol
from sysid_node.report.wording.sources import source_words

LISTED = 3  # sources of each derivative
LEAST = 0.05  # share from which one is listed


@dataclass(frozen=True)
class BudgetRow:
    """One derivative: its largest sources with their shares in percent, and what reduces the first."""

    name: str
    symbol: Markup
    sources: str
    advice: str


def context(run: RunResult) -> Mapping[str, Any]:
    """The rows, in the derivatives' order; without any, whether the estimates state systematic errors all the same.

    The messages of the live node do, but hold no budget.
    """
    if run.final is None:
        return {"rows": [], "stated": False}
    rows = budget_rows(run.final)
    return {"rows": rows, "stated": any(d.systematic_error > 0.0 for d in run.final.derivatives.values())}


def budget_rows(estimates: Estimates) -> list[BudgetRow]:
    """The rows of estimates, in the derivatives' order."""
    return [_row(name, shares) for name, shares in estimates.budget.items() if shares]


def _row(name: str, shares: Mapping[str, float]) -> BudgetRow:
    largest = [(key, share) for key, share in shares.items() if share >= LEAST][:LISTED]
    sources = ", ".join(f"{source_words(key)[0]} {100.0 * share:.0f} %" for key, share in largest)
    return BudgetRow(name, symbol(name), sources, source_words(largest[0][0])[1] if largest else "")


SECTION: Section[RunResult] = Section("budget", "Error budget", "budget.html.j2", context)
