"""Map of tails by derivatives: how far each tail lies from the others, and what has drifted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.wording.fleet import change_words
from sysid_node.report.wording.names import short_meaning, symbol
from sysid_node.report.wording.numbers import NONE, number

_STEPS = (1.0, 2.0, 3.0)  # standard errors at which the colour becomes stronger


@dataclass(frozen=True)
class Cell:
    """One tail's derivative: a CSS class for its colour, the text in it and what it says in full."""

    colour: str
    text: str
    title: str


def context(report: FleetReport) -> dict[str, Any]:
    """A map for each type: heads, and rows of cells by tail."""
    return {"maps": [_map(report, aircraft, tails) for aircraft, tails in report.summary.tails.items()]}


def _map(report: FleetReport, aircraft: str, tails: tuple[str, ...]) -> dict[str, Any]:
    names = [population.series.name for population in report.populations(aircraft)]
    heads: list[Markup] = [symbol(name) for name in names]
    rows = [(tail, [_cell(report, aircraft, tail, name) for name in names]) for tail in tails]
    compared = any(key[0] == aircraft for key in report.summary.deviations)
    return {"aircraft": aircraft, "heads": heads, "rows": rows, "compared": compared}


def _cell(report: FleetReport, aircraft: str, tail: str, name: str) -> Cell:
    key = aircraft, tail, name
    deviation, drift = report.summary.deviations.get(key), report.summary.drifts.get(key)
    if deviation is None and drift is None:
        return Cell("", NONE, f"{tail}, {short_meaning(name)}: too few tails or flights")
    text, words, colour = "", [f"{tail}, {short_meaning(name)}"], ""
    if deviation is not None:
        distance = deviation.distance / deviation.error
        colour = _colour(distance * _sign(report, aircraft, name))
        words.append(f"{number(distance, 2)} standard errors from the other tails")
        text = "\u25cf" if deviation.significant else ""
    else:
        words.append("too few tails to compare it with")
    if drift is not None and drift.significant:
        text += "\u25c6"
        words.append(f"changed {change_words(drift)}")
    return Cell(colour, text, "; ".join(words))


def _sign(report: FleetReport, aircraft: str, name: str) -> float:
    """So that a larger derivative, whichever its sign, is blue."""
    return 1.0 if report.summary.populations[aircraft, name].fit.mean >= 0 else -1.0


def _colour(distance: float) -> str:
    strength = sum(abs(distance) >= step for step in _STEPS)
    return f"{'up' if distance > 0 else 'down'}{strength}" if strength else ""
