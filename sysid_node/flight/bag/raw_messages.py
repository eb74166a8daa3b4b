"""The serialised messages of an open bag, by topic, as rosbags reads them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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


def read_messages(reader: Reader, chosen: Mapping[str, Sequence[Connection]]) -> dict[str, RawMessages]:
    """The messages of the ``chosen`` connections, by the names under which they are given.

    Raises what rosbags raises where the bag is damaged.
    """
    found: dict[str, tuple[list[bytes], list[int], list[int]]] = {name: ([], [], []) for name in chosen}
    by_connection = {connection.id: found[name] for name, connections in chosen.items() for connection in connections}
    every = [connection for connections in chosen.values() for connection in connections]
    for place, (connection, log_ns, message) in enumerate(reader.messages(every) if every else ()):
        data, logs, order = by_connection[connection.id]
        data.append(message)
        logs.append(log_ns)
        order.append(place)
    return {
        name: RawMessages(data, np.array(logs, np.int64), np.array(order, np.int64))
        for name, (data, logs, order) in found.items()
    }
