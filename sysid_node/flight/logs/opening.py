"""Opens whatever is a flight, told by its content, for the commands and the Python interface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.actuation import joint_names
from sysid_node.flight.align import MAX_GAP, flight_record, warn_without_density
from sysid_node.flight.autopilots.base import AdapterSettings
from sysid_node.flight.autopilots.joints import require_known
from sysid_node.flight.autopilots.recorded_topics import autopilot_of
from sysid_node.flight.bag.reader import open_bag, read_streams, reading
from sysid_node.flight.commands import JointMessage, read_commands
from sysid_node.flight.csv import read_csv
from sysid_node.flight.frames import BodyFrame
from sysid_node.flight.live.deflections import checked_deflections
from sysid_node.flight.live.mean_force import checked_force
from sysid_node.flight.live.mean_lift import checked_lift, mean_lift
from sysid_node.flight.live.reading_signs import checked_signs
from sysid_node.flight.live.unchanging import checked_readings
from sysid_node.flight.logs.autopilot_log import AutopilotLog, with_outputs_of
from sysid_node.flight.logs.checks.refusals import refusal_of_log, refusal_of_streams, require
from sysid_node.flight.logs.content import Content, content_of, remapped, say_that_axes_are_known
from sysid_node.flight.logs.damage import reading_log
from sysid_node.flight.logs.fractions import between_commands, joints_of_fractions
from sysid_node.flight.logs.log_streams import LogFlight, flight_of_log
from sysid_node.flight.logs.readers.autopilot_bag import read_autopilot_bag
from sysid_node.flight.logs.readers.dataflash import read_dataflash
from sysid_node.flight.logs.readers.telemetry import read_telemetry
from sysid_node.flight.logs.readers.ulog import read_ulog
from sysid_node.flight.logs.record_streams import streams_from_record
from sysid_node.flight.logs.tables import with_commands
from sysid_node.flight.record import FlightRecord
from sysid_node.flight.streams import COMMAND_FRACTIONS, COMMANDS, Streams, in_order_of_logging


def read_autopilot_log(path: str | Path, settings: AdapterSettings | None = None) -> AutopilotLog | None:
    """What an autopilot's log or a bag of its topics holds; None for a bag of ``topics`` and for a table.

    ``settings`` are those of the adapter, for bags. Raises InputError where the file is damaged or no flight.
    """
    content = content_of(path)
    with reading_log(path):
        if content is Content.ULOG:
            return read_ulog(path)
        if content in (Content.DATAFLASH, Content.DATAFLASH_TEXT):
            return read_dataflash(path, text=content is Content.DATAFLASH_TEXT)
        if content is Content.TELEMETRY:
            return read_telemetry(path)
    if content is Content.ROSBAG1 or (content is Content.ROSBAG2 and is_autopilot_bag(Path(path))):
        return read_autopilot_bag(path, settings)
    return None


def is_autopilot_bag(path: Path) -> bool:
    """Whether a rosbag2 recording holds an autopilot's topics and no air data of ours."""
    if not path.exists():
        return False
    with open_bag(path) as reader, reading(path):
        topics = {c.topic: c.msgtype for c in reader.connections}
    return "sysid_msgs/msg/AirData" not in topics.values() and autopilot_of(topics) is not None


def open_log(
    path: str | Path, settings: AdapterSettings | None = None, outputs: str = "", key: str = "outputs"
) -> LogFlight | None:
    """The flight in an autopilot's log, before its commands become joints; None for other bags and tables.

    ``outputs`` and the ``key`` that states them as of ``flight_of_log``.
    """
    log = read_autopilot_log(path, settings)
    return None if log is None else flight_of_log(log, outputs, key)


def open_streams(
    path: str | Path, aircraft: Aircraft, topics: Mapping[str, str] | None = None, frame: BodyFrame = "flu"
) -> Streams:
    """The messages of any flight, with the aircraft's joints.

    ``topics`` and ``frame`` are for bags of our own topics. Raises InputError where the flight cannot be read, lacks
    a signal, or was logged at too low a rate.
    """
    other_topics = remapped(path, topics)
    log = None if other_topics else read_autopilot_log(path)
    if log is not None:
        say_that_axes_are_known(path, frame, f"log of {log.autopilot}")
        log = with_outputs_of(log, aircraft.outputs)
        require(log.name, refusal_of_log(log, raw_outputs=bool(aircraft.outputs)))
        key = f"aircraft {aircraft.name}: outputs"
        require_known(aircraft.outputs, joint_names(aircraft), f"aircraft {aircraft.name}", key)
        streams = flight_of_log(log, aircraft.outputs, key).streams
    elif is_table(path, topics, frame):
        return streams_from_record(read_csv(path, aircraft.control_symbols), aircraft)
    else:
        streams = read_streams(path, topics, frame)
    require(streams.name, refusal_of_streams(streams))
    if streams.actuators.content == COMMAND_FRACTIONS:
        streams = replace(streams, actuators=joints_of_fractions(streams.actuators, aircraft, streams.name))
    if streams.actuators.content:
        streams = in_order_of_logging(replace(streams, actuators=between_commands(streams.actuators)))
    return streams


def carried_by(streams: Streams, setting: str) -> str:
    """What the actuators' messages are: where the ``setting`` is "auto", commands if the flight says so."""
    return "commands" if setting == "auto" and streams.actuators.content == COMMANDS else setting


def load_flight_record(
    path: str | Path,
    aircraft: Aircraft,
    *,
    topics: Mapping[str, str] | None = None,
    frame: BodyFrame = "flu",
    max_gap: float = MAX_GAP,
    carried: str = "positions",
) -> FlightRecord:
    """Any flight as aligned columns, with ``max_gap`` (s) as in ``align``. Raises InputError.

    ``carried``: what the actuators' messages, or a table's columns, are ("commands", "positions", or "auto").
    """
    if is_table(path, topics, frame):
        record = _checked(aircraft, read_csv(path, aircraft.control_symbols))
        if not record.measured("rho"):
            warn_without_density(aircraft, record.name)
        return with_commands(aircraft, record, carried)
    streams = open_streams(path, aircraft, topics, frame)
    record = flight_record(aircraft, streams, max_gap, carried_by(streams, carried))
    if not np.isfinite(streams.air_data.values[:, 3]).any():
        warn_without_density(aircraft, record.name)
    return _checked(aircraft, record)


def _checked(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record as it is. Raises InputError and warns where it is not a flight of this aircraft in these units."""
    opposite_alpha = mean_lift(aircraft, record).opposite_alpha
    record = checked_signs(checked_force(record), opposite_alpha=opposite_alpha)
    return checked_deflections(aircraft, checked_lift(aircraft, checked_readings(aircraft, record)))


def is_table(path: str | Path, topics: Mapping[str, str] | None = None, frame: BodyFrame = "flu") -> bool:
    """Whether a flight is a table, whose samples are aligned already. Raises InputError where it is no flight.

    ``topics`` and ``frame`` are for bags of our own topics: raises InputError, or warns, where a table is given them.
    """
    if remapped(path, topics) or content_of(path) is not Content.TABLE:
        return False
    say_that_axes_are_known(path, frame, Content.TABLE.value)
    return True


def recorded_commands(path: str | Path) -> list[JointMessage]:
    """The commands that a bag of our own topics holds beside the positions; of other flights an empty list."""
    return read_commands(path) if content_of(path) is Content.ROSBAG2 else []
