"""The serialised messages of an open bag, by topic, as rosbags reads them: all, or in pieces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from sysid_node.flight.streams import Stamps


class RawMessages(NamedTuple):
    """The N serialised messages of one topic, in log order."""

    data: Sequence[bytes]
    log_ns: Stamps  # (N,) when each was recorded, ns
    order: Stamps  # (N,) place among the messages of all topics that are read


class _Parts(NamedTuple):
    """What ``RawMessages`` is made of."""

    data: list[bytes]
    log_ns: list[int]
    order: list[int]


def read_messages(reader: Reader, chosen: Mapping[str, Sequence[Connection]]) -> dict[str, RawMessages]:
    """The messages of the ``chosen`` connections, by the names under which they are given.

    Raises what rosbags raises where the bag is damaged.
    """
    return next(read_pieces(reader, chosen), _packed({name: _Parts([], [], []) for name in chosen}))


def read_pieces(
    reader: Reader, chosen: Mapping[str, Sequence[Connection]], size: int | None = None
) -> Iterator[dict[str, RawMessages]]:
    """The same in pieces of ``size`` messages or a few more: those of one log time are not parted.

    Without a size there is one piece; none where the bag holds no message of these. A connection may stand under
    several names: commands that are read in place of the positions are the commands, too.
    """
    every = {connection.id: connection for connections in chosen.values() for connection in connections}
    found, last = {name: _Parts([], [], []) for name in chosen}, None
    names = {key: [name for name, some in chosen.items() if connection in some] for key, connection in every.items()}
    count = 0
    for place, (connection, log_ns, message) in enumerate(reader.messages(every.values()) if every else ()):
        if size is not None and count >= size and log_ns != last:
            yield _packed(found)
            found, count = {name: _Parts([], [], []) for name in chosen}, 0
        for name in names[connection.id]:
            data, logs, order = found[name]
            data.append(message)
            logs.append(log_ns)
            order.append(place)
        last, count = log_ns, count + 1
    if count:
        yield _packed(found)


def _packed(found: Mapping[str, _Parts]) -> dict[str, RawMessages]:
    return {
        name: RawMessages(data, np.array(logs, np.int64), np.array(order, np.int64))
        for name, (data, logs, order) in found.items()
    }
