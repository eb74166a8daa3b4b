"""``sysid convert``: turns any flight, an autopilot's log or a table, into a bag of the identifier's topics."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.cli.shared import options
from sysid_node.errors import InputError
from sysid_node.flight.actuation import joint_names
from sysid_node.flight.autopilots.base import AdapterSettings, adapter_for
from sysid_node.flight.autopilots.joints import require_known
from sysid_node.flight.autopilots.known import ADAPTERS
from sysid_node.flight.autopilots.recorded import read_recorded
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import STORAGES, write_streams
from sysid_node.flight.csv import read_csv
from sysid_node.flight.logs.content import Content, content_of, remapped
from sysid_node.flight.logs.fractions import joints_of_fractions
from sysid_node.flight.logs.log_streams import LogFlight
from sysid_node.flight.logs.opening import open_log
from sysid_node.flight.logs.rates import rates_of_streams
from sysid_node.flight.logs.record_streams import streams_from_record
from sysid_node.flight.streams import COMMAND_FRACTIONS
from sysid_node.flight.topics import topic_names
from sysid_node.report.files.outputs.output_file import output_bag

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("convert", help="turn a flight log into a bag", description=__doc__)
    parser.add_argument("log", metavar="LOG", type=Path, help=options.LOG_HELP)
    parser.add_argument(
        "--out", metavar="BAG", type=Path, required=True, help="folder of the bag, which must not exist"
    )
    options.add_force(parser)
    parser.add_argument("--aircraft", help="file or name: its joints carry the controls; else elevator, aileron, ...")
    parser.add_argument("--autopilot", choices=list(ADAPTERS), help="LOG is a bag of this autopilot's own topics")
    parser.add_argument(
        "--joints", default="", help="which output moves which joint, NAME=OUTPUT:TRIM:SCALE ... in one argument"
    )
    parser.add_argument("--air-temperature", type=float, help="of a bag of an autopilot's topics: degC (default: 15)")
    parser.add_argument("--air-data-delay", type=float, help="of a bag of an autopilot's topics: s (default: 0)")
    parser.add_argument("--storage", choices=list(STORAGES), default="mcap", help="default: mcap")
    options.add_reading(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Converts the log and prints what was written."""
    aircraft = load_aircraft(args.aircraft) if args.aircraft else None
    with output_bag(args.out, options.inputs_of([args.log], args.aircraft), force=args.force) as bag:
        flight = _opened(args, aircraft)
        streams = flight.streams
        if aircraft is not None and streams.actuators.content == COMMAND_FRACTIONS:
            streams = replace(streams, actuators=joints_of_fractions(streams.actuators, aircraft, streams.name))
        write_streams(bag, streams, args.storage, args.body_frame)
    if not args.quiet:
        _show(args.out, LogFlight(streams, flight.remarks))


def _show(out: Path, flight: LogFlight) -> None:
    streams = flight.streams
    stamps = streams.imu.arrival.stamp_ns
    seconds = (stamps[-1] - stamps[0]) / 1e9
    print(f"{out}: {seconds:.1f} s, {stamps.size} samples; joints {', '.join(streams.actuators.names)}")
    slow = [found.fault for found in rates_of_streams(streams).values() if found.fault]
    for remark in (*flight.remarks, *slow):
        print(f"  {remark}")
    if streams.actuators.content == COMMAND_FRACTIONS:
        print(
            "  the joints are fractions of full command; the aircraft file's full_deflection (rad) of each control "
            "turns them into angles"
        )


def _opened(args: argparse.Namespace, aircraft: Aircraft | None) -> LogFlight:
    """The flight as streams: of an autopilot's log or bag, of a table, or of a bag of our own topics."""
    content = content_of(args.log)
    topics = topic_names(args.topic)
    other_topics = remapped(args.log, topics)
    _refuse_idle(args, content, own=other_topics)
    settings = AdapterSettings(
        args.joints,
        AdapterSettings.air_temperature if args.air_temperature is None else args.air_temperature,
        AdapterSettings.air_data_delay if args.air_data_delay is None else args.air_data_delay,
    )
    outputs = args.joints or (aircraft.outputs if aircraft is not None else "")
    key = "--joints" if args.joints or aircraft is None else f"aircraft {aircraft.name}: outputs"
    if aircraft is not None:
        require_known(outputs, joint_names(aircraft), f"aircraft {aircraft.name}", key)
    if args.autopilot:
        return LogFlight(read_recorded(args.log, adapter_for(args.autopilot, ADAPTERS, settings)), ())
    if content is Content.TABLE:
        controls = None if aircraft is None else aircraft.control_symbols
        return LogFlight(streams_from_record(read_csv(args.log, controls), aircraft), ())
    flight = None if other_topics else open_log(args.log, settings, outputs, key)
    if flight is None:
        _refuse_idle(args, content, own=True)
    return flight or LogFlight(read_streams(args.log, topics, args.body_frame), ())


def _refuse_idle(args: argparse.Namespace, content: Content, *, own: bool) -> None:
    """Raise InputError where an option cannot act on the log, a bag of our ``own`` topics or of another content."""
    given = {
        "--joints": bool(args.joints),
        "--autopilot": args.autopilot is not None,
        "--air-temperature": args.air_temperature is not None,
        "--air-data-delay": args.air_data_delay is not None,
    }
    is_bag = content in (Content.ROSBAG1, Content.ROSBAG2)
    what = "a bag of our own topics" if own else f"a {content.value}"
    for option, stated in given.items():
        acts = not own and (is_bag or (option == "--joints" and content is not Content.TABLE))
        if stated and not acts:
            whose = "a log or a bag of an autopilot" if option == "--joints" else "a bag of an autopilot's topics"
            raise InputError(f"{option} is for {whose}; {args.log} is {what}; leave it out")
