"""Tables of spike and recovery: in all, by effect, by flight, and the calibration of the probabilities."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from bench.pages import table
from bench.withheld.scoreboard import calibration, interval

from .excusing import INEXCUSABLE
from .judging import Judged, judge
from .records import FLIGHTS

_Pairs = Sequence[tuple[Mapping[str, Any], Judged]]


def page(rows: Sequence[Mapping[str, Any]]) -> str:
    """The section of the documentation."""
    bare = {row["flight"]: row["gap"] for row in rows if not row["effect"] and row["gap"]}
    pairs = [(row, _judged(row, bare.get(row["flight"]))) for row in rows]
    spiked = [pair for pair in pairs if pair[0]["effect"]]
    unspiked = [pair for pair in pairs if not pair[0]["effect"]]
    stated = [each for _, judged in pairs for each in judged.stated]
    parts = [
        f"{len(spiked)} cases with an effect put in, {len(unspiked)} records as they are; in brackets 95 % intervals.",
        table(("", "all", "beyond three tolerances", "wanted"), _overall(spiked, unspiked)),
        "The records as they are:",
        table(("record", "verdict", "gap, left, floor", "named", "doubted", "it holds"), map(_as_it_is, unspiked)),
        "By effect:",
        _grouped(spiked, "effect"),
        "By record:",
        _grouped(spiked, "flight"),
        "Those that were not named:",
        table(("record", "put in", "left", "said"), (_missed(row) for row, judged in spiked if not judged.named)),
    ]
    if stated:
        parts += ["Probabilities as stated, and the share of them that is right:", calibration(stated)]
    return "\n\n".join(parts)


def _judged(row: Mapping[str, Any], unspiked: Mapping[str, Any] | None) -> Judged:
    flight = FLIGHTS[row["flight"]]
    return judge(row, flight.holds, unspiked, flight.own)


def share(flags: Iterable[bool | None]) -> str:
    """How many of those that apply, with the interval of the share."""
    known = [flag for flag in flags if flag is not None]
    if not known:
        return "-"
    low, high = interval(sum(known), len(known))
    return f"{sum(known)} of {len(known)} ({100 * low:.0f}-{100 * high:.0f} %)"


def _overall(spiked: _Pairs, unspiked: _Pairs) -> list[list[str]]:
    """Of all cases, and of those that three tolerances of the derivatives do not excuse."""
    beyond = [pair for pair in spiked if (pair[0].get("left") or 0.0) >= INEXCUSABLE]
    rows = [["as they are: nothing blamed above 0.8 that is not there", share(not j.blamed for _, j in unspiked), "",
             "all"]]  # fmt: skip
    for words, flags, wanted in _SCORES:
        rows.append([words, share(flags(spiked)), share(flags(beyond)), wanted])
    return rows


#: What is scored of cases with an effect put in: in words, of each case, and what is wanted.
_SCORES: tuple[tuple[str, Callable[[_Pairs], Iterable[bool | None]], str], ...] = (
    ("put in: named first, or beside what the record holds", lambda c: [j.named for _, j in c], "85 %"),
    ("of those named: size within 20 % or its interval", lambda c: [j.sized for _, j in c], "85 %"),
    ("gap within 10 % of that of the record as it is (same channels)", lambda c: [j.closed for _, j in c], "85 %"),
    ("the same, of those named", lambda c: [j.closed for _, j in c if j.named], ""),
)


def _as_it_is(pair: tuple[Mapping[str, Any], Judged]) -> list[str]:
    row, _ = pair
    holds = FLIGHTS[row["flight"]]
    return [row["flight"], row["verdict"], _gap(row), _names(row["causes"]), _names(row["doubted"]), holds.why]


def _grouped(pairs: _Pairs, key: str) -> str:
    rows = []
    for name in sorted({row[key] for row, _ in pairs}):
        own = [judged for row, judged in pairs if row[key] == name]
        counts = [[getattr(j, what) for j in own] for what in ("named", "sized", "closed")]
        rows.append([name, str(len(own)), *(_count(flags) for flags in counts)])
    return table((key, "cases", "named", "size", "gap closed"), rows)


def _count(flags: Sequence[bool | None]) -> str:
    known = [flag for flag in flags if flag is not None]
    return f"{sum(known)} of {len(known)}" if known else "-"


def _missed(row: Mapping[str, Any]) -> list[str]:
    put = ", ".join(f"{name} {value:.3g}" for name, value in row["values"].items())
    said = row["refusal"] or f"{row['verdict']}: {_names(row['causes'])}"
    doubted = f"; doubted: {_names(row['doubted'])}" if row["doubted"] else ""
    left = f"{row['left']:.2f}" if row.get("left") else "-"
    return [row["flight"], f"{row['effect']} ({put})", left, said + doubted]


def _names(causes: Sequence[Mapping[str, Any]]) -> str:
    return ", ".join(f"{c.get('label', c['effect'])} {c['probability']:.2f}" for c in causes) or "-"


def _gap(row: Mapping[str, Any]) -> str:
    gap = row["gap"]
    return ", ".join(f"{gap[name]:.2f}" for name in ("before", "after", "noise_floor")) if gap else "-"
