"""``sysid view``: shows a flight in 3-D and against time, in the viewer Rerun."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.cli.shared import options
from sysid_node.errors import InputError

if TYPE_CHECKING:
    from sysid_node.view.scene import Scene

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("view", help="show a flight in 3-D and against time", description=__doc__)
    add = parser.add_argument
    add("path", metavar="RUN|BAG", type=Path, nargs="?", help="a folder that a command wrote, or a bag or log")
    add("--live", action="store_true", help="show what is flown and identified now, over ROS, until Ctrl-C")
    add("--aircraft", metavar="FILE|NAME", help="aircraft file, or name as in cdrw; needed for a bag and for --live")
    add("--save", metavar="FILE.rrd", type=Path, help="write a file instead of opening a window")
    options.add_reading(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Opens the viewer, or writes the file and prints its path."""
    from sysid_node.view import recording  # noqa: PLC0415  # not needed to print the help

    recording.require_rerun()
    if args.live == (args.path is not None):
        raise InputError("give either RUN|BAG or --live")
    if args.live:
        _live(args)
        return
    scene = _scene(args)
    if args.save is None:
        recording.show(scene)
        return
    recording.save(scene, args.save)
    if not args.quiet:
        print(args.save)


def _live(args: argparse.Namespace) -> None:
    from sysid_node.aircraft.load import load_aircraft  # noqa: PLC0415
    from sysid_node.cli.live.viewing import watch_live  # noqa: PLC0415

    if args.aircraft is None:
        raise InputError("--live: say which aircraft is flown: --aircraft FILE|NAME")
    watch_live(load_aircraft(args.aircraft), args.save, args.body_frame)


def _scene(args: argparse.Namespace) -> Scene:
    from sysid_node.view.runs import opening  # noqa: PLC0415

    if not args.path.exists():
        raise InputError(f"{args.path}: does not exist; give a folder that a command wrote, or a bag or log")
    folder = opening.run_folder(args.path)
    if folder is not None:
        if args.topic or args.body_frame != "flu":
            raise InputError(f"{args.path}: is a run, to which --topic and --body-frame do nothing; leave them out")
        return opening.scene_of(folder, args.aircraft)
    from sysid_node.api.flight_file import load  # noqa: PLC0415
    from sysid_node.view.runs.bag import scene_of_flight  # noqa: PLC0415

    if args.aircraft is None:
        raise InputError(f"{args.path}: to show a bag, say whose it is: --aircraft FILE|NAME")
    flight = load(args.path, args.aircraft, topics=args.topic, body_frame=args.body_frame)
    return scene_of_flight(flight.record, flight.aircraft)
