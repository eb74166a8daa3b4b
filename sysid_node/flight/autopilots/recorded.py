"""Streams from a recording of an autopilot's own topics: what its adapter would have published."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags.highlevel import AnyReader

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.base import Adapter, AirSample, ImuSample, JointSample, Sample
from sysid_node.flight.autopilots.recorded_topics import RecordedTopics, recorded_topics
from sysid_node.flight.bag.recordings import open_recording, require_definitions
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
    with open_recording(path) as reader:
        chosen = recorded_topics(reader.connections, type(adapter), source)
        if not chosen.connections:
            raise InputError(f"{source}: none of the autopilot's topics in it; expected {', '.join(adapter.topics)}")
        logged = [sample for _, sample in heard_samples(reader, chosen, adapter, path.name)]
    return streams_of_samples(logged, source)


def heard_samples(
    reader: AnyReader, chosen: RecordedTopics, adapter: Adapter, bag: str
) -> Iterator[tuple[str, LoggedSample]]:
    """The samples that an adapter makes of a recording, with the adapter's names of their topics, in log order.

    Raises InputError, which names the ``bag``, where it lacks the definition of a message.
    """
    connections = [c for c in reader.connections if c.id in chosen.connections]
    require_definitions(reader, connections, bag)
    for order, (connection, log_ns, data) in enumerate(reader.messages(connections)):
        message: Any = reader.deserialize(data, connection.msgtype)
        for ours in chosen.connections[connection.id]:
            sample = adapter.hear(ours, message)
            if sample is not None:
                yield ours, LoggedSample(order, log_ns, sample)


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
