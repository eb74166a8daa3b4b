"""A CSV table: a header, then rows. Floats are written as the shortest decimal that reads back as the same bits."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path

Row = Sequence[object]


def write_table(
    path: Path, header: Sequence[str], rows: Iterable[Row], *, blank_nan: bool = False, keep_empty: bool = True
) -> None:
    """Write a table, replacing what is there; None is an empty cell, and NaN is one where ``blank_nan``.

    A table without rows is its header alone, or, unless ``keep_empty``, no file (one from an earlier run is removed).
    """
    iterator = iter(rows)
    first = next(iterator, None)
    if first is None and not keep_empty:
        path.unlink(missing_ok=True)
        return
    content = iterator if first is None else chain([first], iterator)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(map(_without_nan, content) if blank_nan else content)


def _without_nan(row: Row) -> list[object]:
    return ["" if cell != cell else cell for cell in row]  # noqa: PLR0124  # only NaN differs from itself
