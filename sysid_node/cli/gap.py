"""``sysid gap``: where the simulator and the flight differ, which effect causes it, and how far the gap shrinks."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.api.flight_file import load
from sysid_node.cli.shared import options
from sysid_node.cli.shared.terminal import progress_bar

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

#: Folder in ``--out`` that holds the finished steps of an interrupted run.
UNFINISHED = "unfinished"


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    meaning = "find why the simulator does not fly like the aircraft"
    parser = commands.add_parser("gap", help=meaning, description=__doc__)
    parser.add_argument("bags", metavar="BAG", type=Path, nargs="+", help=options.LOG_HELP)
    options.add_aircraft(parser)
    options.add_holdout(parser)
    options.add_out(parser, "; started again with the same folder, an interrupted run continues where it stopped")
    options.add_reading(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Diagnoses the flights and writes the results."""
    from sysid_node.api.gap_diagnosis import diagnose  # noqa: PLC0415  # JAX takes its time

    flights, holdout = (
        [load(path, args.aircraft, topics=args.topic, body_frame=args.body_frame) for path in paths]
        for paths in (args.bags, args.holdout)
    )
    with progress_bar("gap", quiet=args.quiet) as progress:
        found = diagnose(flights, holdout=holdout, resume=args.out / UNFINISHED, progress=progress)
    report = found.save(args.out)
    if not args.quiet:
        print(found.words)
        print(report)
