"""Diagnosed cases kept as lines of a file, so that a set can be gone on with."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .drawing import Case

Row = dict[str, Any]

_CAUSE = ("effect", "label", "probability", "indistinguishable_from", "parameters", "grounds")
_GAP = ("before", "tolerances", "after", "noise_floor", "shrink_percent")


def read(path: Path) -> list[Row]:
    """The lines of a file; none where there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def row(
    case: Case, left: float | None, said: Mapping[str, Any] | None, refusal: str, seconds: float, version: str
) -> Row:
    """A line: what was put in, and what was said of it (gap.json), or why the flight was refused.

    ``left`` is what tolerances leave of the effect (``excusing.ratio_left``); none of a record as it is.
    """
    found: Row = {"seed": case.seed, "flight": case.flight, "effect": case.effect, "values": dict(case.values)}
    found |= {"left": left if left is None else round(left, 3)}
    found |= {"seconds": round(seconds, 1), "version": version, "refusal": refusal}
    if said is None:
        return found | {"verdict": "refused", "gap": None, "air_motion": None, "causes": [], "doubted": []}
    gap = {name: said["gap"][name] for name in _GAP}
    gap["after_by_channel"] = {name: round(each["after"], 5) for name, each in said["gap"]["per_channel"].items()}
    found |= {"verdict": said["verdict"], "gap": gap, "air_motion": said["air_motion"]}
    return found | {key: [{n: c[n] for n in _CAUSE if n in c} for c in said[key]] for key in ("causes", "doubted")}


def add(path: Path, line: Row) -> None:
    """Adds a line at the end of a file."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")
