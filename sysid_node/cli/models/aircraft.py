"""``sysid aircraft``: what an aircraft file says, as a handbook would, and which of its values look unusual."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.cli.shared import options
from sysid_node.dynamics.handbook.handbook import Handbook, handbook
from sysid_node.dynamics.handbook.unusual import Finding, findings_without_flight
from sysid_node.errors import InputError
from sysid_node.online.types import Estimates
from sysid_node.report.files.handbook_folder import write_handbook
from sysid_node.report.files.outputs.output_folder import output_folder
from sysid_node.report.sections import handbook as section
from sysid_node.report.wording.numbers import number

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    meaning = "say what an aircraft file means, as a handbook would"
    parser = commands.add_parser("aircraft", help=meaning, description=__doc__)
    parser.add_argument("aircraft", metavar="FILE|NAME", help="aircraft file, or name as in cdrw")
    words = "leave out the error budget, for which the file is flown in the simulator"
    parser.add_argument("--no-budget", dest="budget", action="store_false", help=words)
    parser.add_argument("--out", metavar="DIR", type=Path, help="folder for report.html and aircraft.json")
    options.add_force(parser)
    options.add_quiet(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Prints the handbook, and writes it where ``--out`` is given."""
    aircraft = load_aircraft(args.aircraft)
    book = _handbook(args, aircraft)
    expected = _expected(aircraft) if args.budget else "it was not asked for"
    if args.out is not None:
        inputs = options.inputs_of([], args.aircraft)
        with output_folder(args.out, "aircraft", inputs=inputs, force=args.force) as folder:
            folder.publish(lambda stage: write_handbook(stage, book, expected))
    if not args.quiet:
        _show(book, expected)
        if args.out is not None:
            print(f"\nreport: {args.out / 'report.html'}")


def _handbook(args: argparse.Namespace, aircraft: Aircraft) -> Handbook:
    """The handbook. Where there is none, raises InputError after the checks that need no flight are shown."""
    try:
        return handbook(aircraft)
    except InputError as error:
        if not args.quiet:
            _show_findings(Console(highlight=False, soft_wrap=True), findings_without_flight(aircraft))
        raise InputError(f"{args.aircraft}: {error}") from error


def _expected(aircraft: Aircraft) -> Estimates | str:
    """The estimates of a usual flight, or why there are none."""
    from sysid_node.api.expected_estimates import expected_estimates  # noqa: PLC0415  # NumPy and SciPy take their time

    try:
        return expected_estimates(aircraft)
    except InputError as error:
        return f"the file cannot be flown in the simulator ({error})"
    except ModuleNotFoundError as error:
        return f"it needs the package {error.name}, which is not installed; run: pip install -r requirements/desk.txt"


def _show(book: Handbook, expected: Estimates | str) -> None:
    console = Console(highlight=False, soft_wrap=True)
    console.print(f"{book.aircraft.name}: static margin {section.static_margin(book)}", style="bold", markup=False)
    tables = (
        *(section.trim_table(book), section.mode_table(book), section.performance_table(book)),
        *(section.power_table(book), section.servo_table(book.aircraft), section.tolerance_table(book.aircraft)),
    )
    for table in tables:
        if table.rows:
            _print(console, table)
    if isinstance(expected, str):
        console.print(f"\nno error budget: {expected}", markup=False)
    elif expected.budget:
        _print(console, section.budget_table(expected))
    if book.left_out:
        console.print(f"not part of these numbers: {', '.join(book.left_out)}", markup=False)
    _show_findings(console, book.findings)


def _show_findings(console: Console, findings: Sequence[Finding]) -> None:
    unusual = [finding for finding in findings if finding.unusual]
    count = f"{len(unusual)} of {len(findings)} values look unusual" if unusual else ""
    console.print(f"\n{count or f'none of {len(findings)} checked values looks unusual'}", style="bold")
    for finding in unusual:
        value = f"{number(finding.value)} {'' if finding.unit == '1' else finding.unit}".rstrip()
        text = f"  {finding.name} = {value} (usual: {finding.usual}): {finding.meaning}"
        console.print(f"{text} [{finding.source}]", style="yellow", markup=False)


def _print(console: Console, table: section.TextTable) -> None:
    console.print(f"\n{table.title}", style="bold", markup=False)
    shown = Table(box=None, header_style="bold", pad_edge=False)
    for i, heading in enumerate(table.headings):
        right = i > 0 and (table.numbers or i == 1)
        shown.add_column(heading, justify="right" if right else "left", no_wrap=table.numbers or i < 2)
    for row in table.rows:
        shown.add_row(*row)
    console.print(shown)
