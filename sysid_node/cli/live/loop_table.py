"""The live table of ``sysid loop``: the flight's state, its tracking errors, and the derivatives that matter to it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from sysid_node.cli.live.loop_scenario import NODES, ONSET, LoopScenario
from sysid_node.cli.shared.terminal import plain

if TYPE_CHECKING:
    from sysid_node.ros.support.loop_watch import LoopWatch

WATCHED = ("Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr")
LAST = 200  # rows of tracking errors: about a second


def loop_table(scenario: LoopScenario, watch: LoopWatch) -> RenderableType:
    """The live table at the flight's present time."""
    lines = [f"{node}: {watch.said(node)}" for node in NODES]
    last = watch.tracking[-LAST:]
    errors = ", ".join(f"{axis} {_rms(last, axis):.2f} deg" for axis in ("pitch", "roll", "sideslip"))
    tracking = Text(f"tracking error over the last second: {errors}")
    return Group(_headline(scenario, watch.time), tracking, _derivatives(scenario, watch), *map(Text, lines))


def _headline(scenario: LoopScenario, time: float) -> Text:
    failed = bool(scenario.fail) and time >= ONSET
    head = Text(f"{scenario.aircraft.name}  {time:5.1f} of {scenario.seconds:.0f} s  ", style="bold")
    return head.append(scenario.fail if failed else "no failure", style="red" if failed else "green")


def _derivatives(scenario: LoopScenario, watch: LoopWatch) -> Table:
    table = Table(box=None, padding=(0, 1), header_style="bold")
    for heading in ("derivative", "file", "estimate", "95 % interval", "status"):
        table.add_column(heading, justify="left" if heading in ("derivative", "status") else "right")
    estimates = watch.estimates.derivatives if watch.estimates else {}
    for name in (n for n in WATCHED if n in scenario.aircraft.derivatives):
        file = f"{scenario.aircraft.derivatives[name].value:+.4f}"
        d = estimates.get(name)
        if d is None or not math.isfinite(d.value):
            table.add_row(name, file, "", "", d.status if d else "")
            continue
        status = Text(d.status, style="green" if d.valid else "dim")
        table.add_row(name, file, plain(d.value, "+"), f"{plain(d.lower, '+')} to {plain(d.upper, '+')}", status)
    return table


def _rms(rows: Sequence[tuple[float, Mapping[str, float]]], axis: str) -> float:
    """Root-mean-square tracking error of an axis, deg; NaN without data."""
    values = [e for _, row in rows if math.isfinite(e := row.get(f"{axis} error", math.nan))]
    return math.degrees(math.sqrt(sum(v * v for v in values) / len(values))) if values else math.nan
