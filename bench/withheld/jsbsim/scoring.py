"""What is right of a diagnosis of a JSBSim case, and the scores over cases. The rules were fixed before the first case.

One effect: it is the first cause, of the right control or coefficient, or among the two first alternatives to it. Two
effects: each is a cause, or among the two first alternatives to one. Nothing withheld: ``no_gap``. On no list:
``unknown_effect``. A size is right within 15 % or within its stated 95 % interval.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from bench.withheld.judging import BLAMED, TOGETHER
from bench.withheld.scoreboard import interval

_WITHIN = 0.15

#: Least share of the error that the true effect must close for a share of that to be counted.
_CLOSABLE = 0.05

Case = Mapping[str, Any]  # a line of the ledger


def sizes(case: Case) -> list[tuple[str, float, float, float]]:
    """Parameters of the true effects that are causes by their own name: name, true, found, standard error."""
    return [
        (f"{cause['effect']}.{key}", true, *cause["parameters"][key])
        for cause in case["causes"]
        for key, true in case["true_sizes"].get(cause["effect"], {}).items()
        if key in cause["parameters"]
    ]


def named(case: Case) -> bool:
    """Whether the verdict and causes are those of the case; of two effects, whether both are named."""
    if case["kind"] == "none":
        return bool(case["verdict"] == "no_gap")
    if case["kind"] == "unlisted":
        return bool(case["verdict"] == "unknown_effect")
    causes = case["causes"][:1] if len(case["true_sizes"]) == 1 else case["causes"]
    return all(any(_is(effect, values, cause) for cause in causes) for effect, values in case["true_sizes"].items())


def _is(effect: str, values: Mapping[str, float], cause: Case) -> bool:
    """Whether a cause is an effect of the right control or coefficient, or has it among its alternatives."""
    if cause["effect"] != effect:
        return effect in cause["indistinguishable_from"][: TOGETHER - 1]
    _, _, scope = cause["label"].partition(" of ")
    (key,) = values
    coefficient = key.partition("_")[0]
    return not scope or scope in (key, coefficient) or (scope == "each control" and key in cause["parameters"])


def right_surface(case: Case) -> bool:
    """Whether the slow servo's surface alone is blamed, or beside others that are left at what the file says."""
    (control,) = case["true_sizes"]["actuator_lag"]
    return any(cause["label"] == f"actuator_lag of {control}" for cause in case["causes"])


def closed_of_true(case: Case) -> float | None:
    """Share of what the true effect closes in JSBSim that the correction closes; none where that is next to nothing."""
    there, truth = case.get("reflown"), case.get("by_truth")
    if (
        not there
        or not truth
        or there["before"] is None
        or not truth["before"] - truth["after"] > _CLOSABLE * truth["before"]
    ):
        return None
    return float((there["before"] - there["after"]) / (truth["before"] - truth["after"]))


def _of(cases: Sequence[Case], *kinds: str) -> list[Case]:
    return [case for case in cases if case["kind"] in kinds]


def _single(cases: Sequence[Case], air: str) -> list[bool]:
    return [named(case) for case in _of(cases, "one", "slow servo") if case["turbulence"] == air]


def _pairs(cases: Sequence[Case]) -> list[Case]:
    return [case for case in _of(cases, "one", "two", "slow servo") if named(case)]


def _sized(case: Case) -> bool:
    return all(_holds(*rest) or abs(rest[1] - rest[0]) <= _WITHIN * abs(rest[0]) for _, *rest in sizes(case))


def _holds(true: float, found: float, error: float) -> bool:
    return abs(found - true) <= 1.96 * error


def _shares(cases: Sequence[Case]) -> list[bool]:
    shares = (closed_of_true(case) for case in _pairs(cases))
    return [share >= 0.9 for share in shares if share is not None]


#: What is scored: in words, of which cases which are right, and what is wanted.
_SCORES: tuple[tuple[str, Callable[[Sequence[Case]], Iterable[bool]], str], ...] = (
    ("nothing withheld: `no_gap`", lambda c: map(named, _of(c, "none")), "95 %"),
    ("one effect, still air: named", lambda c: _single(c, "none"), "90 %"),
    ("one effect, light turbulence: named", lambda c: _single(c, "light"), "85 %"),
    ("one slow servo: the right surface", lambda c: map(right_surface, _of(c, "slow servo")), "95 %"),
    ("two effects: both named", lambda c: map(named, _of(c, "two")), "75 %"),
    ("on no list: `unknown_effect`", lambda c: map(named, _of(c, "unlisted")), "85 %"),
    ("on no list: a listed effect blamed above 0.9",
     lambda c: [any(x["probability"] > BLAMED for x in case["causes"]) for case in _of(c, "unlisted")], "under 5 %"),
    ("of those named: sizes within 15 % or their intervals",
     lambda c: [_sized(case) for case in _pairs(c) if sizes(case)], "90 %"),
    ("each size: within its 95 % interval",
     lambda c: [_holds(*rest) for case in _pairs(c) for _, *rest in sizes(case)], "90 %"),
    ("of those named, flown again in JSBSim: 90 % of what the true effect closes", _shares, "90 %"),
)  # fmt: skip


def rows(cases: Sequence[Case]) -> list[list[str]]:
    """Of the table of scores: all cases, and those of each way in."""
    groups = [cases, *([case for case in cases if case["way"] == way] for way in ("import", "simulated"))]
    return [[words, *(_share(list(right(group))) for group in groups), wanted] for words, right, wanted in _SCORES]


def _share(flags: Sequence[bool]) -> str:
    if not flags:
        return "-"
    low, high = interval(sum(flags), len(flags))
    return f"{sum(flags)} of {len(flags)} ({100 * low:.0f} to {100 * high:.0f} %)"
