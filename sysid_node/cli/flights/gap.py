"""``sysid gap``: where the simulator and the flight differ, which effect causes it, and how far the gap shrinks."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.api.flight_file import load
from sysid_node.cli.shared import options
from sysid_node.cli.shared.terminal import progress_bar
from sysid_node.flight.commanded import CARRIED
from sysid_node.report.files.outputs.output_folder import output_folder

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    meaning = "find why the simulator does not fly like the aircraft"
    parser = commands.add_parser("gap", help=meaning, description=__doc__)
    parser.add_argument("bags", metavar="BAG", type=Path, nargs="+", help=options.LOG_HELP)
    options.add_aircraft(parser)
    options.add_holdout(parser)
    parser.add_argument(
        "--simulator",
        metavar="jsbsim:NAME|FILE",
        help="your simulator's model: the correction is written into a copy, and both fly the held-out commands there",
    )
    meaning = (
        "flights recorded in your simulator, on the same topics: it is identified from them, and stands in its place"
    )
    parser.add_argument("--simulated", metavar="SIM", type=Path, nargs="+", action="extend", default=[], help=meaning)
    meaning = "what the actuators' messages are (default: told from the messages of all flights)"
    parser.add_argument("--actuators", choices=CARRIED, default="auto", help=meaning)
    options.add_out(parser, "; started again with the same folder, an interrupted run continues where it stopped")
    options.add_reading(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Diagnoses the flights and writes the results."""
    from sysid_node.api.gap_diagnosis import diagnose  # noqa: PLC0415  # JAX takes its time
    from sysid_node.report.files.gap_folder import UNFINISHED  # noqa: PLC0415

    for paths in (args.bags, args.holdout, args.simulated):
        options.refuse_twice(paths)
    flights, holdout, simulated = (
        [load(path, args.aircraft, topics=args.topic, body_frame=args.body_frame) for path in paths]
        for paths in (args.bags, args.holdout, args.simulated)
    )
    inputs = options.inputs_of([*args.bags, *args.holdout, *args.simulated], args.aircraft)
    with output_folder(args.out, "gap", inputs=inputs, force=args.force, working=[UNFINISHED]) as out:
        with progress_bar("gap", quiet=args.quiet) as progress:
            found = diagnose(flights, holdout=holdout, simulator=args.simulator, simulated=simulated,
                             actuators=args.actuators, resume=args.out / UNFINISHED, progress=progress)  # fmt: skip
        out.publish(found.write)
    if not args.quiet:
        print(found.words)
        print(args.out / "report.html")
