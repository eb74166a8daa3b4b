"""What stands out in the fleet, in a few sentences."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.wording.fleet import cause_sentences, tail_sentence
from sysid_node.report.wording.names import short_meaning
from sysid_node.report.wording.numbers import number, plural

#: Sentences of one kind at most; the sections below hold all.
_MOST = 8


def opening(report: FleetReport) -> dict[str, Any]:
    """Facts about the fleet, and sentences about drift, tails that stand out, and causes."""
    summary = report.summary
    tails = sum(len(names) for names in summary.tails.values())
    drifting = [
        tail_sentence(report.tail_name(*key), list(found), report.maintenance(*key))
        for key, found in groupby(report.drifts, key=lambda d: (d.aircraft, d.tail))
    ]
    causes = cause_sentences(report)
    facts = [
        ("Flights", str(summary.flights)),
        ("Tails", str(tails)),
        ("Types", ", ".join(summary.tails) or "none"),
        ("Refused", str(len(report.results.refusals))),
    ]
    warned = sum(bool(flight.remarks) for flight in report.results.flights)
    if warned:
        facts.append(("With warnings", str(warned)))
    return {
        "facts": facts,
        "drifting": _shortened(drifting),
        "odd": _shortened([_odd(report, k) for k in range(len(report.odd))]),
        "causes": _shortened(causes),
        "nothing": "" if drifting or report.odd or causes else _nothing(report),
        "flights": plural(summary.flights, "flight"),
        "tails": plural(tails, "tail"),
    }


def _nothing(report: FleetReport) -> str:
    """What was looked for and not found, and what the flights did not allow to look for."""
    diagnosed = any(flight.gap is not None for flight in report.results.flights)
    looked_for = (
        (report.summary.drifts, "No tail drifts.", "Too few flights of a tail to look for drift."),
        (report.summary.deviations, "None stands out from its type.", "Too few tails to compare one with the others."),
        (
            diagnosed,
            "No cause of a gap belongs to the simulator or to a tail.",
            "No flight was diagnosed, so that nothing is said of the simulator.",
        ),
    )
    return " ".join(found if possible else not_possible for possible, found, not_possible in looked_for)


def _odd(report: FleetReport, k: int) -> str:
    found = report.odd[k]
    mean = report.summary.populations[found.aircraft, found.name].fit.mean
    share = f"{number(100 * abs(found.distance / mean), 2)}\u202f%" if mean else number(abs(found.distance), 2)
    weaker = "weaker" if found.distance * mean < 0 else "stronger"
    tail = report.tail_name(found.aircraft, found.tail)
    return f"{tail}: {short_meaning(found.name)} is {share} {weaker} than that of the other tails."


def _shortened(sentences: list[str]) -> list[str]:
    if len(sentences) <= _MOST:
        return sentences
    return [*sentences[: _MOST - 1], f"{len(sentences) - _MOST + 1} more; the sections below show them."]
