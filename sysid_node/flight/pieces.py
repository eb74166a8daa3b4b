"""A flight in pieces, so that one of many hours needs no more memory than one of minutes.

Bags of our own topics are read in pieces, sqlite3 and mcap alike. Other flights (logs of autopilots, tables, bags made
of logs, whose rates and fractions are those of the whole flight) are one piece.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.bag.raw_messages import read_messages, read_pieces
from sysid_node.flight.bag.reader import RecordingWatch, decoded, input_connections, open_bag, reading
from sysid_node.flight.commands import JointMessage, command_connections, decoded_commands
from sysid_node.flight.frames import BodyFrame
from sysid_node.flight.logs.content import Content, content_of, remapped
from sysid_node.flight.logs.opening import is_autopilot_bag, open_streams, recorded_commands
from sysid_node.flight.streams import Streams
from sysid_node.flight.topics import IMU, topic_names

#: Messages of a piece: two minutes at 200 Hz, with air data, positions and commands at 50 Hz.
PIECE = 40_000

#: Most messages that a bag is believed to hold, by its own count: years of flight.
_MOST = 10**12

_COMMANDS = "commands"


class FlightPiece(NamedTuple):
    """The messages of a part of a flight, and the commands recorded beside the positions; whether it is the last."""

    streams: Streams
    commands: Sequence[JointMessage]
    last: bool


class FlightPieces(NamedTuple):
    """A flight that is being read. ``messages`` and ``imu_messages``: how many of the inputs there are, of the IMU."""

    name: str
    messages: int
    imu_messages: int
    pieces: Iterator[FlightPiece]


@contextmanager
def flight_pieces(
    path: Path, aircraft: Aircraft, topics: Mapping[str, str] | None = None, frame: BodyFrame = "flu", size: int = PIECE
) -> Iterator[FlightPieces]:
    """A flight to be read in pieces while the context lasts; the arguments are those of ``open_streams``.

    Raises InputError as ``open_streams`` does, and while pieces are taken, where the bag turns out to be damaged.
    """
    if content_of(path) is not Content.ROSBAG2 or (not remapped(path, topics) and is_autopilot_bag(path)):
        yield _whole(path, aircraft, topics, frame)
        return
    with open_bag(path) as reader:
        inputs, name = topics or topic_names(), f"bag {path.name}"
        with reading(path):
            chosen = input_connections(reader, inputs, name)
        pieces = _pieces(path, reader, chosen, RecordingWatch(name, inputs, chosen), frame, size)
        first = next(pieces)
        if not first.streams.actuators.content:
            promised = {topic: sum(c.msgcount for c in connections) for topic, connections in chosen.items()}
            counts = {topic: min(count, _MOST) for topic, count in promised.items()}  # a damaged bag states any number
            yield FlightPieces(name, sum(counts.values()), counts[IMU], chain([first], pieces))
            return
    yield _whole(path, aircraft, topics, frame)


def _whole(path: Path, aircraft: Aircraft, topics: Mapping[str, str] | None, frame: BodyFrame) -> FlightPieces:
    """A flight that is one piece."""
    streams = open_streams(path, aircraft, topics, frame)
    counts = [len(stream.arrival) for stream in streams.by_topic.values()]
    piece = FlightPiece(streams, recorded_commands(path), last=True)
    return FlightPieces(streams.name, sum(counts), counts[0], iter([piece]))


def _pieces(
    path: Path,
    reader: Reader,
    chosen: Mapping[str, Sequence[Connection]],
    watch: RecordingWatch,
    frame: BodyFrame,
    size: int,
) -> Iterator[FlightPiece]:
    """The pieces of an open bag; the last one is empty. Raises InputError where the bag is damaged."""
    name = f"bag {path.name}"
    joints: tuple[str, ...] = ()
    commands = command_connections(reader)
    with reading(path):
        for raw in read_pieces(reader, {**chosen, **({_COMMANDS: commands} if commands else {})}, size):
            watch.take(raw)
            streams = decoded(raw, frame, name, joints)
            if joints and streams.actuators.content:
                raise InputError(
                    f"{name}: the frame_id of the actuators becomes {streams.actuators.content!r} in the recording; "
                    "cut it there"
                )
            joints = streams.actuators.names
            told = raw[_COMMANDS] if commands else None
            yield FlightPiece(
                streams,
                decoded_commands(list(zip(told.log_ns.tolist(), told.data, strict=True))) if told else (),
                last=False,
            )
        watch.close()
        yield FlightPiece(decoded(read_messages(reader, dict.fromkeys(chosen, ())), frame, name, joints), (), last=True)
