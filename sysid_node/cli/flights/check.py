"""``sysid check``: what a flight's file holds, what it is good for, and which setting of the autopilot to change."""

from __future__ import annotations

import argparse
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.flights.verdicts import refusals_told, refusals_tried, verdicts
from sysid_node.cli.shared import options
from sysid_node.errors import InputError
from sysid_node.flight.logs.checks.survey import LogSurvey, survey
from sysid_node.flight.logs.rates import rate_text
from sysid_node.flight.topics import topic_names

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("check", help="say what a flight's file is good for", description=__doc__)
    parser.add_argument("logs", metavar="LOG", type=Path, nargs="+", help=options.LOG_HELP)
    parser.add_argument("--aircraft", metavar="FILE|NAME", help="say what the commands do with this aircraft file")
    options.add_topics(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Prints a table for each log. Raises after the last where one could not be read.

    InputError where all of these are bad input, RuntimeError where a reader failed.
    """
    aircraft = load_aircraft(args.aircraft) if args.aircraft else None
    topics, frame = topic_names(args.topic), args.body_frame
    unread: list[str] = []
    kind: type[Exception] = InputError
    for path in args.logs:
        try:
            found = survey(path, aircraft, topics, frame)
            refused = refusals_told(found) if aircraft is None else refusals_tried(path, aircraft, topics, frame)
            _show(found, verdicts(found, refused, aircraft_known=aircraft is not None))
        except InputError as error:
            text = str(error)
            unread.append(text if path.name in text else f"{path.name}: {text}")
        except Exception as error:  # a fault of a reader must not hide the other files
            if args.debug:
                traceback.print_exc()
            unread.append(f"{path.name}: {type(error).__name__}: {error}")
            kind = RuntimeError
    if unread:
        raise kind("; ".join(unread))


def _show(found: LogSurvey, good_for: Mapping[str, str]) -> None:
    console = Console(highlight=False, soft_wrap=True)
    console.print(f"[bold]{found.name}[/bold]: {found.kind}, {found.seconds:.1f} s", markup=True)
    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in ("signal", "from", "rate", "gaps", "clock", "use"):
        table.add_column(heading, justify="right" if heading == "rate" else "left", no_wrap=True)
    for row in found.rows:
        style = "red" if row.verdict != "ok" else ""
        rate = f"{rate_text(row.rate)} Hz" if row.rate else "-"
        cells = (row.signal, row.source, rate, row.gaps, row.clock, row.verdict)
        table.add_row(*cells, style=style)
    console.print(table)
    for label, lines in (("excited", found.excitation), ("good for", good_for)):
        for name, text in lines.items():
            console.print(f"  {label:9} {name}: {text}", markup=False)
    for label, texts in (("change", found.remedies), ("note", found.remarks)):
        for text in texts:
            console.print(f"  {label:9} {text}", markup=False)
