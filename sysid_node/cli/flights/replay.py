"""``sysid replay``: identifies an aircraft from a bag with the functions of the live node, message for message."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.api.flight_file import load
from sysid_node.api.replaying import replay
from sysid_node.cli.shared import options
from sysid_node.cli.shared.terminal import progress_bar, show_estimates, show_faults
from sysid_node.report.files.outputs.output_folder import output_folder

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("replay", help="identify an aircraft from a bag, as the live node does")
    parser.description = "Identify an aircraft from a bag; writes summary.json, tables, report.html and estimates/."
    parser.add_argument("bag", metavar="BAG", type=Path, help=options.LOG_HELP)
    options.add_aircraft(parser)
    options.add_out(parser)
    options.add_settings(parser, "any node parameter", "the transform")
    options.add_reading(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Replays the bag and writes the results."""
    flight = load(args.bag, args.aircraft, topics=args.topic, body_frame=args.body_frame)
    settings = options.settings_of(args.set, args.frequencies, "window=20")
    inputs = options.inputs_of([args.bag], args.aircraft)
    with output_folder(args.out, "replay", inputs=inputs, force=args.force) as out:
        with progress_bar(f"replay {args.bag.name}", quiet=args.quiet) as progress:
            found = replay(flight, settings, progress=progress)
        out.publish(found.write)
    if not args.quiet:
        show_estimates(found.final, found.truth.values, found.truth.since)
        if found.faults:
            show_faults(found.faults)
        print(args.out / "report.html")
