"""Judged cases kept as lines of a file, so that a set can be gone on with where its bags are no more.

Each line holds the version of the diagnosis that was judged: a digest of the sources that decide. A set is one
version's, or it says nothing of any.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import sysid_node
from bench.withheld import judging
from bench.withheld.judging import Judged

#: What is kept of a cause that was named or doubted: effect, nats, misfit, whether it was there.
Weighed = tuple[str, float, float, bool]

#: What the scoreboard reads of a gap.
_GAP = ("before", "after", "noise_floor", "shrink_percent", "ci95")


#: Packages whose sources decide what a diagnosis says.
_DECIDING = ("aircraft", "dynamics", "flight", "gap", "sim")


@cache
def version() -> str:
    """Digest of the sources that decide what a diagnosis says."""
    root = Path(sysid_node.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(path for name in _DECIDING for path in (root / name).rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


def read(path: Path | None, wanted: str | None = None) -> dict[int, Judged]:
    """The cases of a file by seed; none where there is no file.

    Raises ValueError where they are of several versions, or not of the one wanted.
    """
    if path is None or not path.exists():
        return {}
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    versions = {row["version"] for row in rows} | ({wanted} if wanted else set())
    if len(versions) > 1:
        raise ValueError(f"{path}: cases of versions {', '.join(sorted(versions))}; a set is one's: take another file")
    return {int(row["label"]["seed"]): _judged(row) for row in rows}


def add(path: Path, judged: Judged, weighed: list[Weighed], by: str = "") -> None:
    """Adds a case at the end of a file, judged ``by`` a version of the sources: these, unless another is named."""
    row = asdict(replace(judged, gap={name: judged.gap[name] for name in _GAP if name in judged.gap}))
    row["weighed"], row["version"] = weighed, by or version()
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row, ensure_ascii=False) + "\n")


def weighed_by(label: Mapping[str, Any], said: Mapping[str, Any]) -> Iterator[Weighed]:
    """The causes that were named or doubted; not what a plant always has: that is right whatever speaks for it."""
    for cause in (*said["causes"], *said.get("doubted", ())):
        if not judging.always_there(label, cause):
            own = cause["grounds"]
            yield cause["effect"], own["log_bayes_factor"], own["misspecification"], judging.there(label, cause)


def causes(path: Path) -> Iterator[tuple[int, Weighed]]:
    """The causes of a file, each after its case's seed."""
    for line in path.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        for effect, nats, misfit, there in row["weighed"]:
            yield int(row["label"]["seed"]), (effect, nats, misfit, there)


def _judged(row: dict[str, Any]) -> Judged:
    return Judged(**{field.name: _tuples(row[field.name]) for field in fields(Judged)})


def _tuples(value: Any) -> Any:
    """Lists as the tuples that they were."""
    return tuple(_tuples(part) for part in value) if isinstance(value, list) else value
