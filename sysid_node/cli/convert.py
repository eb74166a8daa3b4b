"""``sysid convert``: a flight log as a bag on the topics that the identifier listens to."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.bag_writer import STORAGES, write_streams
from sysid_node.flight.frames import BODY_FRAMES
from sysid_node.flight.logs import READERS, read_log, streams_of

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("convert", help="turn a flight log into a bag", description=__doc__)
    parser.add_argument("log", metavar="LOG", type=Path, help=f"a flight log ({', '.join(READERS)})")
    parser.add_argument(
        "--out", metavar="BAG", type=Path, required=True, help="folder of the bag, which must not exist"
    )
    parser.add_argument("--aircraft", help="file or name: its joints carry the controls; else elevator, aileron, ...")
    parser.add_argument("--storage", choices=list(STORAGES), default="mcap", help="default: mcap")
    parser.add_argument(
        "--body-frame", choices=BODY_FRAMES, default="flu", help="of the IMU messages (default: flu, REP-103)"
    )
    parser.add_argument("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Converts the log."""
    aircraft = load_aircraft(args.aircraft) if args.aircraft else None
    flight = read_log(args.log)
    streams = streams_of(flight, aircraft)
    write_streams(args.out, streams, args.storage, args.body_frame)
    if not args.quiet:
        print(
            f"{args.out}: {flight.duration:.1f} s, {len(flight)} samples; joints {', '.join(streams.actuators.names)}"
        )
