"""The live table: every derivative with its estimate, 95 % interval, status and reference value."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rich.console import Group, RenderableType
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from sysid_node.aircraft.names import LONGITUDINAL
from sysid_node.cli.shared.terminal import plain
from sysid_node.online.types import DerivativeEstimate, Estimates

SIDE_BY_SIDE = 170  # width of a terminal, in columns, from which the two halves stand side by side
HEADS = 5  # lines besides the derivatives: headline, remark, headings of the tables, cursor
TURN = 3.0  # s of flight for which each half is shown if there is no room for both


@dataclass(frozen=True)
class ReferenceValues:
    """What the estimates are compared with: the truth of a simulated flight, or the aircraft file's values."""

    label: str  # heading of the column: "true" or "file"
    values: Mapping[str, float]


@dataclass(frozen=True)
class LiveStatus:
    """The content of the live table at one time."""

    title: str
    seconds: float  # of flight so far
    duration: float  # s, of the whole flight
    remark: str
    estimates: Estimates | None


def live_table(
    moment: LiveStatus, names: Sequence[str], reference: ReferenceValues, width: int, height: int | None = None
) -> RenderableType:
    """The table for a terminal that is ``width`` columns wide.

    Where it is too high for a terminal of ``height`` lines, its halves are shown by turns.
    """
    groups = [[n for n in names if (n.split("_")[0] in LONGITUDINAL) == first] for first in (True, False)]
    known = moment.estimates.derivatives if moment.estimates else {}
    tables = [_table(group, known, reference) for group in groups if group]
    if width >= SIDE_BY_SIDE:
        grid = Table.grid(padding=(0, 3))
        grid.add_row(*tables)
        return Group(_headline(moment), grid)
    if height is not None and len(names) + HEADS > height:
        tables = [tables[int(moment.seconds / TURN) % len(tables)]]
    return Group(_headline(moment), *tables)


def _headline(moment: LiveStatus) -> RenderableType:
    derivatives = moment.estimates.derivatives.values() if moment.estimates else ()
    valid = sum(d.valid for d in derivatives)
    line = Table.grid(padding=(0, 2))
    line.add_row(
        Text(moment.title, style="bold"),
        ProgressBar(total=moment.duration, completed=min(moment.seconds, moment.duration), width=24),
        f"{moment.seconds:5.1f} of {moment.duration:.0f} s",
        Text(f"{valid} valid", style="green" if valid else "dim"),
    )
    return Group(line, Text(moment.remark, style="dim"))


def _table(names: Sequence[str], known: Mapping[str, DerivativeEstimate], reference: ReferenceValues) -> Table:
    table = Table(box=None, padding=(0, 1), header_style="bold")
    table.add_column("derivative", min_width=10)
    for heading in ("estimate", "95 % interval", reference.label):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("")
    table.add_column("status", width=18, no_wrap=True)
    for name in names:
        table.add_row(name, *_cells(known.get(name), reference.values.get(name, math.nan)))
    return table


def _cells(estimate: DerivativeEstimate | None, expected: float) -> tuple[Text, ...]:
    if estimate is None or not math.isfinite(estimate.value):
        return Text(), Text(), _number(expected, "dim"), Text(), Text(estimate.status if estimate else "", style="dim")
    style = "" if estimate.valid else "dim"
    inside = estimate.lower <= expected <= estimate.upper
    mark = Text("✓", style="green") if inside else Text("✗", style="yellow")
    return (
        _number(estimate.value, "bold" if estimate.valid else "dim"),
        Text(f"{plain(estimate.lower, '+')} to {plain(estimate.upper, '+')}", style=style),
        _number(expected, ""),
        mark if estimate.valid and math.isfinite(expected) else Text(),
        Text(estimate.status, style="green" if estimate.valid else "dim"),
    )


def _number(value: float, style: str) -> Text:
    return Text(plain(value, "+") if math.isfinite(value) else "", style=style)
