"""A fleet's findings in a technician's words: ``aileron power -18 % since 3 May 2026``."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from itertools import groupby

from sysid_node.fleet.results import MaintenanceNote
from sysid_node.fleet.statistics.causes import PooledCause
from sysid_node.fleet.statistics.drift import Drift
from sysid_node.fleet.statistics.series import DAY
from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.wording.causes import label_words
from sysid_node.report.wording.names import short_meaning
from sysid_node.report.wording.numbers import MINUS, likely, listing, number

#: Standard errors by which a level must differ from zero for a change to be given as a share of it.
_SURE = 4.0


def date_words(day: float) -> str:
    """A day since 1970 as ``3 May 2026``."""
    date = datetime.datetime.fromtimestamp(day * DAY, datetime.UTC).date()
    return f"{date.day} {date:%B %Y}"


def change_words(drift: Drift) -> str:
    """The change in percent of the level before it, or as a number where that level is hardly known."""
    if abs(drift.before) > _SURE * drift.error and not drift.name.endswith("_0"):
        return f"{_signed(100.0 * drift.change / drift.before, 2)}\u202f%"
    return f"changed by {_signed(drift.change, 2)}"


def drift_words(drift: Drift) -> str:
    """One drift: what, how much and since when."""
    what = f"{short_meaning(drift.name)} {change_words(drift)}"
    if drift.course.kind == "configuration":
        return f"{what} in the configuration {drift.course.configuration}"
    if drift.course.kind == "trend":
        return f"{what} little by little from {date_words(drift.course.first)} to {date_words(drift.course.last)}"
    return f"{what} since {date_words(drift.course.since)}"


def tail_sentence(tail: str, drifts: Sequence[Drift], notes: Sequence[MaintenanceNote] = ()) -> str:
    """All significant drifts of a tail, and the maintenance notes that lie where a step does."""
    parts = "; ".join(drift_words(drift) for drift in drifts)
    beside = [note for note in notes if any(_beside(note, drift) for drift in drifts)]
    said = "".join(f" Maintenance on {_date_of(note)}: {note.text}." for note in beside)
    return f"{tail}: {parts}; the others are unchanged.{said}"


def _beside(note: MaintenanceNote, drift: Drift) -> bool:
    """Whether maintenance was within the dates between which a step lies (a day more on either side)."""
    day = note.date.timestamp() / DAY
    return drift.course.kind == "step" and drift.course.first - 1.0 <= day <= drift.course.last + 1.0


def _date_of(note: MaintenanceNote) -> str:
    return date_words(note.date.timestamp() / DAY)


def account_words(cause: PooledCause) -> str:
    """Whose a cause is, in one sentence."""
    if cause.account == "simulator":
        return f"The simulator lacks it: all tails share it (probability {likely(cause.shared)})."
    if cause.account == "tail":
        tails = [tail.tail for tail in cause.tails if tail.own >= 0.5]
        return f"{listing(tails)} {'has' if len(tails) == 1 else 'have'} it alone: it is not the simulator's."
    return "Single flights named it, and neither the type nor a tail has it with an even chance."


def findings(report: FleetReport) -> list[str]:
    """What has changed, tail by tail, and whose each cause is: a sentence each."""
    drifting = [
        tail_sentence(report.tail_name(*key), list(found), report.maintenance(*key))
        for key, found in groupby(report.drifts, key=lambda d: (d.aircraft, d.tail))
    ]
    return [*drifting, *cause_sentences(report)]


def cause_sentences(report: FleetReport) -> list[str]:
    """Whose each cause is that the type or a tail has: a sentence each."""
    causes = [cause for cause in report.summary.causes if cause.account != "flight"]
    return [f"{label_words(cause.label)} ({cause.aircraft}): {account_words(cause)}" for cause in causes]


def _signed(value: float, digits: int) -> str:
    return ("+" if value > 0 else MINUS) + number(abs(value), digits)
