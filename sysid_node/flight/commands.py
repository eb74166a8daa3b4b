"""The commands to the joints in a recorded flight, message by message in log order."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from sysid_node.flight.bag.message_types import definitions_of, type_store
from sysid_node.flight.bag.reader import open_bag, reading
from sysid_node.flight.cdr.decoding import decode
from sysid_node.flight.topics import ACTUATORS, INPUT_TOPICS

#: Where positions are recorded by ``sysid simulate``, if the topic ``actuators`` carries commands.
POSITIONS = "/actuators/position"
#: Where commands are recorded (``docs/reference/bags.md``), and their type: that of the positions.
COMMANDS, COMMANDS_TYPE = "/actuators/command", INPUT_TOPICS[ACTUATORS]


class JointMessage(NamedTuple):
    """Joints by name: rad; throttle 0..1 or N."""

    log_ns: int
    stamp_ns: int
    names: tuple[str, ...]
    positions: tuple[float, ...]


def read_commands(path: str | Path) -> list[JointMessage]:
    """The commands in a bag that ``read_streams`` can read; an empty list where it holds none of this type.

    Raises InputError where it is damaged.
    """
    path = Path(path)
    with open_bag(path) as reader, reading(path):
        chosen = command_connections(reader)
        found = [(log_ns, data) for _, log_ns, data in reader.messages(chosen)] if chosen else []
        return decoded_commands(found)


def holds_commands(path: str | Path) -> bool:
    """Whether a bag holds commands beside the topic ``actuators``. Raises InputError where it cannot be read."""
    path = Path(path)
    with open_bag(path) as reader, reading(path):
        return bool(command_connections(reader))


def command_connections(reader: Reader) -> list[Connection]:
    """The connections of a bag on which commands were recorded; empty where there are none."""
    return [c for c in reader.connections if (c.topic, c.msgtype) == (COMMANDS, COMMANDS_TYPE)]


def decoded_commands(found: Sequence[tuple[int, bytes]]) -> list[JointMessage]:
    """The messages from their log times and bytes, by log time."""
    messages = []
    for places, fields in decode(definitions_of(type_store()), COMMANDS_TYPE, [data for _, data in found]):
        seconds, fraction = (fields.numbers(f"header.stamp.{part}").tolist() for part in ("sec", "nanosec"))
        names = fields.strings("name")
        rows = zip(places.tolist(), seconds, fraction, fields.numbers("position").tolist(), strict=True)
        messages += [JointMessage(found[i][0], s * 10**9 + ns, names, tuple(values)) for i, s, ns, values in rows]
    return sorted(messages, key=lambda message: message.log_ns)
