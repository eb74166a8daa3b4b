"""``sysid report``: writes report.html again from the files of a run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.report.files.rewriting import rewrite_report

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("report", help="write report.html again from the files of a run", description=__doc__)
    parser.add_argument(
        "directory", metavar="DIR", type=Path, help="the --out folder of replay, identify, demo or loop"
    )
    parser.add_argument("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Draws the page and prints its path."""
    path = rewrite_report(args.directory)
    if not args.quiet:
        print(path)
