"""``sysid convert``: turns a log, or a bag of an autopilot's own topics, into a bag of the identifier's topics."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.shared import options
from sysid_node.flight.autopilots.base import AdapterSettings, adapter_for
from sysid_node.flight.autopilots.known import ADAPTERS
from sysid_node.flight.autopilots.recorded import read_recorded
from sysid_node.flight.bag.writer import STORAGES, write_streams
from sysid_node.flight.frames import BODY_FRAMES
from sysid_node.flight.logs import READERS, read_log, streams_from_record
from sysid_node.flight.streams import Streams
from sysid_node.report.files.output_file import output_bag

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("convert", help="turn a flight log into a bag", description=__doc__)
    parser.add_argument("log", metavar="LOG", type=Path, help=f"a flight log ({', '.join(READERS)}), or a bag")
    parser.add_argument(
        "--out", metavar="BAG", type=Path, required=True, help="folder of the bag, which must not exist"
    )
    options.add_force(parser)
    parser.add_argument("--aircraft", help="file or name: its joints carry the controls; else elevator, aileron, ...")
    parser.add_argument("--autopilot", choices=list(ADAPTERS), help="LOG is a bag of this autopilot's own topics")
    parser.add_argument("--joints", default="", help="with --autopilot: NAME=OUTPUT:TRIM:SCALE ... in one argument")
    parser.add_argument(
        "--air-temperature",
        type=float,
        default=AdapterSettings.air_temperature,
        help="with --autopilot: degC (default: 15)",
    )
    parser.add_argument(
        "--air-data-delay", type=float, default=AdapterSettings.air_data_delay, help="with --autopilot: s (default: 0)"
    )
    parser.add_argument("--storage", choices=list(STORAGES), default="mcap", help="default: mcap")
    parser.add_argument(
        "--body-frame", choices=BODY_FRAMES, default="flu", help="of the IMU messages (default: flu, REP-103)"
    )
    parser.add_argument("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Converts the log and prints what was written."""
    inputs = options.inputs_of([args.log], args.aircraft)
    with output_bag(args.out, inputs, force=args.force) as bag:
        streams = _recorded(args) if args.autopilot else _logged(args)
        write_streams(bag, streams, args.storage, args.body_frame)
    if not args.quiet:
        stamps = streams.imu.arrival.stamp_ns
        seconds = (stamps[-1] - stamps[0]) / 1e9
        print(f"{args.out}: {seconds:.1f} s, {stamps.size} samples; joints {', '.join(streams.actuators.names)}")


def _logged(args: argparse.Namespace) -> Streams:
    aircraft = load_aircraft(args.aircraft) if args.aircraft else None
    return streams_from_record(read_log(args.log), aircraft)


def _recorded(args: argparse.Namespace) -> Streams:
    settings = AdapterSettings(args.joints, args.air_temperature, args.air_data_delay)
    return read_recorded(args.log, adapter_for(args.autopilot, ADAPTERS, settings))
