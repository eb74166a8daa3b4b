"""What of a diagnosis of a real record with a known effect is right, by rules that were fixed before."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

#: Probability above which a cause that is not there counts as blamed in a record as it is.
BLAMED = 0.8

#: Most effects that a set named together may hold.
TOGETHER = 3

#: Share by which a size may be off, and by which the gap may exceed that of the record as it is.
_SIZE, _GAP = 0.2, 0.1

#: Parameters that only shape an effect, or are not what was put in.
_SHAPES = frozenset({"onset"})


@dataclass(frozen=True)
class Judged:
    """One case: whether the effect was named (first or beside what the record holds), its size right, the gap closed.

    ``stated`` are the probabilities of all causes, and whether each is there. None: does not apply.
    """

    named: bool | None
    sized: bool | None
    closed: bool | None
    blamed: bool  # something is blamed that is not there
    stated: tuple[tuple[float, bool], ...]


def judge(
    row: Mapping[str, Any],
    holds: Sequence[str],
    unspiked: Mapping[str, Any] | None,
    own: Mapping[str, float] = MappingProxyType({}),
) -> Judged:
    """A case by its line of the ledger; ``unspiked`` is the gap of the record as it is, on its line.

    ``own`` are sizes of effects that the record itself holds, of one control under "effect.control": what is put in
    adds to them.
    """
    effect, values = row["effect"], row["values"]
    stated = tuple((c["probability"], _there(c, effect, holds)) for c in row["causes"])
    wrong = any(p > BLAMED and not there for p, there in stated)
    if not effect:
        return Judged(None, None, None, wrong, stated)
    others = [c for c in row["causes"] if not _among(c, holds) or _among(c, (effect,))]
    named = bool(others) and _among(others[0], (effect,))
    found = next((c for c in row["causes"] if c["effect"] == effect), None)
    sized = (
        all(_sized(found["parameters"], n, v, effect, own) for n, v in _sizes(effect, values))
        if named and found
        else None
    )
    closed = None if unspiked is None or row["gap"] is None else _is_back(row["gap"], unspiked)
    return Judged(named, sized, closed, wrong, stated)


def _is_back(gap: Mapping[str, Any], unspiked: Mapping[str, Any]) -> bool:
    """Whether a gap has fallen to that of the record as it is, on the channels that are counted in both.

    A channel counts where the commands excite it. Where a surface is said to have been held, its command moves although
    the aircraft does not, so that more channels count than in the record as it is.
    """
    known = [each.get("after_by_channel") for each in (gap, unspiked)]
    both = known[0].keys() & known[1].keys() if all(known) else set()
    if not both:  # an older line
        return bool(gap["after"] <= (1.0 + _GAP) * unspiked["after"])
    now, then = (math.fsum(each[name] ** 2 for name in both) for each in known)
    return now <= (1.0 + _GAP) ** 2 * then


def _there(cause: Mapping[str, Any], effect: str, holds: Sequence[str]) -> bool:
    return _among(cause, (*holds, effect))


def _among(cause: Mapping[str, Any], effects: Sequence[str]) -> bool:
    """Whether a cause, or one of those that it is not told apart from, is one of these."""
    return bool({cause["effect"], *cause["indistinguishable_from"][: TOGETHER - 1]} & set(effects))


def _sizes(effect: str, values: Mapping[str, float]) -> list[tuple[str, float]]:
    """Parameters whose size was put in; a surface that is held has none."""
    return [] if effect == "stuck_surface" else [(n, v) for n, v in values.items() if n not in _SHAPES]


def _sized(
    found: Mapping[str, Sequence[float]], name: str, put_in: float, effect: str, own: Mapping[str, float]
) -> bool:
    """Whether a parameter's size is right; what acts on controls is stated for each of them, named after it."""
    stated = {name: found[name]} if name in found else _by_control(found)
    true = put_in + own.get(effect, 0.0)
    return bool(stated) and all(_close(each, true + own.get(f"{effect}.{of}", 0.0)) for of, each in stated.items())


def _by_control(found: Mapping[str, Sequence[float]]) -> dict[str, Sequence[float]]:
    """The size of each control; of a lag of second order the time 2 zeta T by which the control comes late.

    A lag that is put in before the record's own makes one of second order, whose lateness is the sum of both.
    """
    if "damping" not in found:
        return dict(found)
    damping, spread = found["damping"]
    controls = {name: each for name, each in found.items() if name != "damping"}
    return {
        of: (2.0 * damping * time, 2.0 * math.hypot(damping * error, spread * time))
        for of, (time, error) in controls.items()
    }


def _close(found: Sequence[float], true: float) -> bool:
    """Whether a value with its standard error is within a fifth of the true one, or its 95 % interval holds this."""
    value, error = found
    return abs(value - true) <= max(_SIZE * abs(true), 1.96 * error)
