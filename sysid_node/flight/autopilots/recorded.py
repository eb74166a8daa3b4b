"""Streams from a recording of an autopilot's own topics: what its adapter would have published."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_types_from_msg
from rosbags.typesys.store import Typestore

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.base import Adapter, AirSample, ImuSample, JointSample, Sample
from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.storage_files import checked_files
from sysid_node.flight.frames import euler_from_quaternion
from sysid_node.flight.record import Array
from sysid_node.flight.streams import AirDataStream, Arrival, ImuStream, JointStream, Streams


class LoggedSample(NamedTuple):
    """A sample, and place and log time of the message that gave it."""

    order: int
    log_ns: int
    sample: Sample


def read_recorded(path: str | Path, adapter: Adapter) -> Streams:
    """The streams that the adapter makes of a bag of the autopilot's topics, message by message in log order.

    Raises InputError where the bag cannot be read, lacks a topic or the definition of a message, or gives no sample.
    """
    path = Path(path)
    source = f"bag {path.name}"
    try:
        return streams_of_samples(_read(path, adapter, source), source)
    except InputError:
        raise
    except Exception as error:  # parsers of a damaged file raise all kinds of exceptions
        words = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{source}: cannot be read: {words}; give a rosbag2 folder, .mcap or .db3 file") from error


def _read(path: Path, adapter: Adapter, source: str) -> list[LoggedSample]:
    with checked_files(path) as files, Reader(files) as reader:
        chosen = [connection for connection in reader.connections if connection.topic in adapter.topics]
        if not chosen:
            raise InputError(f"{source}: none of the autopilot's topics in it; expected {', '.join(adapter.topics)}")
        return list(_samples(reader, chosen, _types(chosen, adapter, source), adapter))


def _types(connections: list[Connection], adapter: Adapter, source: str) -> Typestore:
    """The type store, with the definitions of the messages that the bag holds."""
    store = deepcopy(type_store())
    for connection in connections:
        wanted = adapter.topics[connection.topic]
        if connection.msgtype != wanted:
            raise InputError(f"{source}: topic {connection.topic} is {connection.msgtype}, expected {wanted}")
        if connection.msgtype in store.fielddefs:
            continue
        if not connection.msgdef.data:
            raise InputError(
                f"{source}: no definition of {connection.msgtype} in it; convert it to mcap where that is installed"
            )
        found = get_types_from_msg(connection.msgdef.data, connection.msgtype)
        store.register({name: fields for name, fields in found.items() if name not in store.fielddefs})
    return store


def _samples(
    reader: Reader, connections: list[Connection], store: Typestore, adapter: Adapter
) -> Iterator[LoggedSample]:
    for order, (connection, log_ns, data) in enumerate(reader.messages(connections)):
        message: Any = store.deserialize_cdr(data, connection.msgtype)
        sample = adapter.hear(connection.topic, message)
        if sample is not None:
            yield LoggedSample(order, log_ns, sample)


def streams_of_samples(logged: list[LoggedSample], name: str) -> Streams:
    """The streams of the samples of each kind. Raises InputError where there is none of a kind."""
    imu = [(one, one.sample) for one in logged if isinstance(one.sample, ImuSample)]
    air = [(one, one.sample) for one in logged if isinstance(one.sample, AirSample)]
    joints = [(one, one.sample) for one in logged if isinstance(one.sample, JointSample)]
    motion = np.array([(*s.force, *s.rates) for _, s in imu]).reshape(-1, 6)
    flow = np.array([(s.true_airspeed, s.angle_of_attack, s.sideslip, s.air_density) for _, s in air]).reshape(-1, 4)
    names = joints[0][1].names if joints else ()
    positions = np.array([s.positions for _, s in joints]).reshape(len(joints), len(names))
    return Streams(
        ImuStream(_arrival([one for one, _ in imu]), motion, _euler([s for _, s in imu]), "base_link"),
        AirDataStream(_arrival([one for one, _ in air]), flow),
        JointStream(_arrival([one for one, _ in joints]), names, positions),
        name,
    )


def _arrival(logged: list[LoggedSample]) -> Arrival:
    stamps, logs, orders = (
        [one.sample.stamp_ns for one in logged],
        [one.log_ns for one in logged],
        [one.order for one in logged],
    )
    return Arrival(np.array(stamps, np.int64), np.array(logs, np.int64), np.array(orders, np.int64))


def _euler(samples: list[ImuSample]) -> Array:
    """Euler angles (N, 3) rad, NaN where there is no attitude."""
    none = (np.nan,) * 4
    wxyz = np.array([sample.attitude or none for sample in samples]).reshape(-1, 4)
    return euler_from_quaternion(np.roll(wxyz, -1, axis=1), "frd")
