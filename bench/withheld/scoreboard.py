"""Scores over cases, with the uncertainty that their number leaves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import pairwise

from scipy.stats import beta

from bench.pages import table
from bench.withheld.drawing import FOREIGN
from bench.withheld.judging import BLAMED, Judged
from bench.withheld.plants.sizes import SIZES

#: Column of all plants but the foreign one.
OWN = "own plants"

_ALPHA = 0.05
_EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.99, 1.01)  # of the bins of stated probability


def interval(right: int, of: int) -> tuple[float, float]:
    """95 % interval of a share: Clopper and Pearson (1934), Biometrika 26."""
    low = float(beta.ppf(_ALPHA / 2, right, of - right + 1)) if right else 0.0
    high = float(beta.ppf(1 - _ALPHA / 2, right + 1, of - right)) if right < of else 1.0
    return low, high


def page(cases: Sequence[Judged], failed: Sequence[str] = ()) -> str:
    """The section of the documentation: cases that were judged, and why others could not be."""
    if not cases:
        return "No case was diagnosed."
    columns = _by_plant(cases)
    rows = [[what, *(_share(flags(c)) for c in (cases, *columns.values())), wanted] for what, flags, wanted in _SCORES]
    counts = ", ".join(f"{len(each)} of {'the ' * (name == OWN)}{name}" for name, each in columns.items())
    parts = [
        f"{len(cases)} cases, {counts}; in brackets 95 % intervals.",
        table(("", "all", *columns, "wanted"), rows),
        "Probabilities as stated, and the share of them that is right:",
        _calibrated(cases),
    ]
    if OWN in columns:
        parts += ["The same of the own plants, which have nothing beside what was drawn:", _calibrated(columns[OWN])]
    parts += [
        "By effect: cases with it, how many were right, and what was said first in the others.",
        table(("effect", "plant", "cases", "right", "else"), _confusion(cases)),
    ]
    if failed:
        parts.append(f"Not flown: {'; '.join(failed)}.")
    return "\n\n".join(parts)


def _by_plant(cases: Sequence[Judged]) -> dict[str, Sequence[Judged]]:
    """The cases of the own plants and of the foreign one, or of each size where other sizes were flown."""
    plants = {name: [c for c in cases if c.label["plant"] == name] for name in (FOREIGN, *SIZES)}
    if any(plants[name] for name in SIZES):
        return {name: plants[name] for name in SIZES}
    return {OWN: [c for c in cases if c.label["plant"] != FOREIGN], FOREIGN: plants[FOREIGN]}


def _share(flags: Iterable[bool]) -> str:
    """As a count, with the interval of the share."""
    known = list(flags)
    if not known:
        return "-"
    low, high = interval(sum(known), len(known))
    return f"{sum(known)} of {len(known)} ({100 * low:.0f}-{100 * high:.0f} %)"


_Cases = Sequence[Judged]


def _one(cases: _Cases, air: str) -> list[bool]:
    return [c.right for c in cases if c.kind == "one" and c.label["turbulence"] == air]


def _named(cases: _Cases) -> list[Judged]:
    return [c for c in cases if c.kind in ("one", "two") and c.right]


def _wholly(cases: _Cases) -> list[Judged]:
    """Of those named, pairs only where both are: what was not named cannot be closed."""
    return [c for c in _named(cases) if c.every is not False]


def _held(cases: _Cases, *, still: bool) -> list[bool]:
    """Whether each size lies within its own 95 % interval, however narrow."""
    own = [c for c in _named(cases) if (c.label["turbulence"] == "none") == still]
    return [abs(found - true) <= 1.96 * error for c in own for _, true, found, error in c.parameters]


def _of_kind(cases: _Cases, kind: str) -> list[Judged]:
    return [c for c in cases if c.kind == kind]


#: What is scored: in words, of which cases which are right, and what is wanted.
_SCORES = (
    ("one effect, still air: named first, or in a set of three", lambda c: _one(c, "none"), "90 %"),
    ("the same, light turbulence", lambda c: _one(c, "light"), "80 %"),
    ("the same, moderate turbulence", lambda c: _one(c, "moderate"), ""),
    ("two effects: both named", lambda c: [bool(x.every) for x in _of_kind(c, "two")], "70 %"),
    ("of those named: parameters within 15 % or their intervals",
     lambda c: [x.sized for x in _named(c) if x.sized is not None], "90 %"),
    ("each parameter: within its 95 % interval, still air", lambda c: _held(c, still=True), ""),
    ("the same, turbulence", lambda c: _held(c, still=False), ""),
    ("of those with an onset: within 2 s", lambda c: [x.onset <= 2.0 for x in _named(c) if x.onset is not None], "all"),
    ("no effect: no_gap",
     lambda c: [x.right for x in _of_kind(c, "none") if x.label["plant"] != FOREIGN], "95 %"),
    (f"{FOREIGN} with nothing added: nothing blamed but what it has",
     lambda c: [x.right for x in _of_kind(c, "none") if x.label["plant"] == FOREIGN], "95 %"),
    ("not in the list: unknown_effect", lambda c: [x.right for x in _of_kind(c, "unlisted")], "80 %"),
    ("not in the list: a listed effect blamed above 0.9",
     lambda c: [any(p > BLAMED for p, _ in x.stated) for x in _of_kind(c, "unlisted")], "under 5 %"),
    ("of those named: 90 % of the closable gap closed, as stated",
     lambda c: [x.closed >= 0.9 for x in _named(c)], "90 %"),
    ("of those named, pairs with both: 90 % of what the true effect closes (own: in the plant; c172p: beside the "
     "held-out record)",
     lambda c: [x.closed_of_true >= 0.9 for x in _wholly(c) if x.closed_of_true is not None], "90 %"),
    ("the same, pairs of which one is named among them",
     lambda c: [x.closed_of_true >= 0.9 for x in _named(c) if x.closed_of_true is not None], ""),
    ("the stated interval of the shrinkage holds that of further flights",
     lambda c: [x.covers for x in c if x.covers is not None], "90 %"),
)  # fmt: skip


def _calibrated(cases: _Cases) -> str:
    return calibration([s for c in cases for s in c.stated])


def calibration(stated: Sequence[tuple[float, bool]]) -> str:
    """A table of bins, and the expected calibration error: Naeini, Cooper & Hauskrecht (2015), AAAI."""
    rows, error = [], 0.0
    for low, high in pairwise(_EDGES):
        own = [pair for pair in stated if low <= pair[0] < high]
        if own:
            said, right = (sum(column) / len(own) for column in zip(*own, strict=True))
            error += abs(said - right) * len(own) / len(stated)
            ends = "-".join(f"{end:.2f}" for end in interval(sum(r for _, r in own), len(own)))
            rows.append([f"{low:g} to {min(high, 1.0):g}", f"{said:.2f}", f"{right:.2f}", ends, str(len(own))])
    rows.append(["expected calibration error (wanted: under 0.08)", "", f"{error:.2f}", "", str(len(stated))])
    return table(("stated", "mean stated", "right", "95 %", "causes"), rows)


def _confusion(cases: _Cases) -> list[list[str]]:
    rows = []
    for effect in sorted({e for c in cases for e in _effects(c)}):
        for plant, flown in _by_plant(cases).items():
            with_it = [c for c in flown if effect in _effects(c)]
            if with_it:
                missed = Counter(c.first for c in with_it if not _found(effect, c))
                others = ", ".join(f"{name} {count}" for name, count in missed.most_common())
                right = str(sum(_found(effect, c) for c in with_it))
                rows.append([effect, plant.removesuffix(" plants"), str(len(with_it)), right, others])
    return rows


def _effects(case: Judged) -> tuple[str, ...]:
    return tuple(case.label["effects"]) or ("none",)


def _found(effect: str, case: Judged) -> bool:
    if case.kind in ("none", "unlisted"):
        return case.right
    return any(effect in names for names in case.named)
