"""``sysid report DIR``: draws ``report.html`` again from the files of a run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Adds the subcommand."""
    parser = subparsers.add_parser(
        "report",
        help="draw report.html again from the files of a run",
        description="Draws DIR/report.html again from summary.json and the CSV tables that replay or identify wrote.",
    )
    parser.add_argument("directory", metavar="DIR", type=Path, help="the --out folder of sysid replay or identify")
    parser.add_argument("--quiet", action="store_true", help="print nothing")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Runs the subcommand; 0 when done. Raises InputError where the folder holds no run."""
    from sysid_node.report.folder import rebuild_report  # noqa: PLC0415  (keeps `sysid --help` quick)

    path = rebuild_report(arguments.directory)
    if not arguments.quiet:
        print(path)
    return 0
