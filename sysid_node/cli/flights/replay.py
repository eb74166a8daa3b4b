"""``sysid replay``: identifies an aircraft from a bag with the functions of the live node, message for message."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.api.flight_file import load
from sysid_node.api.replaying import replay
from sysid_node.cli.shared import options
from sysid_node.cli.shared.terminal import progress_bar, show_estimates, show_faults
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.frames import BODY_FRAMES, BodyFrame
from sysid_node.report.files.outputs.output_folder import output_folder

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

#: The node's parameters that matter in flight alone.
_IN_FLIGHT = frozenset({"stale_after", "save_directory", "autostart"})


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
    settings = options.settings_of(args.set, args.frequencies, "window=20")
    frame = _of_reading(settings, args.body_frame)
    flight = load(args.bag, args.aircraft, topics=args.topic, body_frame=frame)
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


def _of_reading(settings: dict[str, object], body_frame: BodyFrame) -> BodyFrame:
    """The IMU's axes; takes from the settings those parameters of the node that are none of the estimator's.

    Raises InputError where one is wrong, and warns (InputWarning) where one changes nothing in a replay.
    """
    if "aircraft" in settings:
        raise InputError("--set aircraft: give it as --aircraft")
    given = settings.pop("body_frame", body_frame)
    frame = next((known for known in BODY_FRAMES if known == given), None)
    if frame is None:
        raise InputError(f"setting body_frame = {given!r}: expected {' or '.join(BODY_FRAMES)}")
    for name in _IN_FLIGHT & settings.keys():
        warnings.warn(
            f"setting {name} = {settings.pop(name)!r} changes nothing in a replay", InputWarning, stacklevel=2
        )
    return frame
